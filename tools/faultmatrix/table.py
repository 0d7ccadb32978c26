"""The matrix as a document's section."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from faultmatrix.cells import BAD, MODES, Cell

BEGIN, END = "<!-- matrix: begin -->", "<!-- matrix: end -->"


def bad(cells: Iterable[Cell]) -> list[Cell]:
    """Cells that must not be."""
    return [cell for cell in cells if cell.verdict in BAD]


def section(cells: Sequence[Cell]) -> str:
    """Markdown: one table for each kind."""
    lines = [BEGIN]
    for kind in dict.fromkeys(cell.kind for cell in cells):
        mine = [cell for cell in cells if cell.kind == kind]
        count = Counter(cell.verdict for cell in mine)
        shares = ", ".join(f"{n} {verdict}" for verdict, n in count.most_common())
        modes = [mode for mode in MODES if any(cell.mode == mode for cell in mine)]
        lines += [f"**{kind.capitalize()}**: {len(mine)} cells, {shares}.", ""]
        lines += ["| fault | " + " | ".join(modes) + " |", "|---" * (len(modes) + 1) + "|"]
        by_place = {(cell.fault, cell.mode): cell for cell in mine}
        for fault in dict.fromkeys(cell.fault for cell in mine):
            row = [_words(by_place.get((fault, mode))) for mode in modes]
            lines.append(f"| `{fault}` | " + " | ".join(row) + " |")
        lines.append("")
    return "\n".join(lines) + END + "\n"


def _words(cell: Cell | None) -> str:
    if cell is None:  # not tried by a quick matrix
        return ""
    words = cell.words.replace("|", "/")
    return f"**{words}**" if cell.verdict in BAD else words


def replaced(path: Path, text: str, begin: str, end: str) -> None:
    """Write a section between its markers, in place of the one before; or a new file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    old = path.read_text(encoding="utf-8") if path.exists() else ""
    before, found, rest = old.partition(begin)
    after = rest.partition(end)[2].removeprefix("\n") if found else ""
    path.write_text(before + text + after, encoding="utf-8")


def write(path: Path, text: str) -> None:
    """The tables, into a document or a file of their own."""
    replaced(path, text, BEGIN, END)
