"""Switches and drive lines of a stage packed into one number of the shared status."""

from __future__ import annotations

from collections.abc import Mapping

from macromicro.serve.shared import LINES

NAMES = tuple(name for name in LINES if name != "index_count")


def packed(lines: Mapping[str, float]) -> float:
    found = 0
    for place, name in enumerate(NAMES):
        if name in lines:
            found |= (1 | (2 if lines[name] != 0.0 else 0)) << 2 * place
    return float(found)


def told(number: float, stage: str = "") -> tuple[tuple[str, bool], ...]:
    """The lines of a stage, as `snapshot.Snapshot.lines`."""
    bits, before = int(number), f"{stage}_" if stage else ""
    each = ((name, bits >> 2 * place) for place, name in enumerate(NAMES))
    return tuple((f"{before}{name}", bool(own & 2)) for name, own in each if own & 1)
