"""The matrix as a document's section."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import measured_page
import numpy as np

from faultmatrix.cells import BAD, HARMLESS, MODES, SAFE_, UNSEEN, Cell

HEAD = ("fault", "safe by", "within", "not visible", "harmless")


def bad(cells: Iterable[Cell]) -> list[Cell]:
    """Cells that must not be."""
    return [cell for cell in cells if cell.verdict in BAD]


def section(cells: Sequence[Cell]) -> str:
    """Markdown: one table for each kind, with a row for each fault."""
    lines = []
    for kind in dict.fromkeys(cell.kind for cell in cells):
        mine = [cell for cell in cells if cell.kind == kind]
        count = Counter(cell.verdict for cell in mine)
        shares = ", ".join(f"{n} {verdict}" for verdict, n in count.most_common())
        modes = [mode for mode in MODES if any(cell.mode == mode for cell in mine)]
        lines += [f"**{kind.capitalize()}**: {len(mine)} cells, {shares}.", ""]
        alike: dict[tuple[str, ...], list[str]] = {}  # faults by what they lead to
        for fault in dict.fromkeys(cell.fault for cell in mine):
            effect = _effect([cell for cell in mine if cell.fault == fault], modes)
            alike.setdefault(effect, []).append(fault)
        rows = []
        for (safe, unseen, harmless), faults in alike.items():
            names = ", ".join(f"`{fault}`" for fault in faults)
            seconds = [
                cell.seconds for cell in mine if cell.fault in faults and cell.verdict == SAFE_
            ]
            longest = f"{np.nanmax(seconds):.3g} s" if np.isfinite(seconds).any() else "-"
            rows.append((names, safe, longest, unseen, harmless))
        lines.append(measured_page.table(HEAD, rows))
    return "\n".join(lines)


def _effect(cells: Sequence[Cell], modes: Sequence[str]) -> tuple[str, ...]:
    """What stops the machine, modes without a sign, and without harm."""
    safe, unseen, harmless = (
        [cell for cell in cells if cell.verdict == verdict] for verdict in (SAFE_, UNSEEN, HARMLESS)
    )
    stops = [f"**{cell.mode}: {cell.words}**" for cell in bad(cells)] + _each(safe)
    why = f"{_modes(unseen, modes)}: {' or '.join(_each(unseen))}" if unseen else "-"
    found = ("; ".join(stops) or "-", why, _modes(harmless, modes))
    return tuple(words.replace("|", "/") for words in found)


def _each(cells: Sequence[Cell]) -> list[str]:
    return sorted({cell.what for cell in cells})


def _modes(cells: Sequence[Cell], modes: Sequence[str]) -> str:
    named = [mode for mode in modes if any(cell.mode == mode for cell in cells)]
    return "all" if named == list(modes) else ", ".join(named) or "-"
