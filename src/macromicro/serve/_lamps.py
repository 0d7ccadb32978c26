"""Switches and drive lines of two axes packed into one number of the shared status."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from macromicro.control.live.messages import AXES
from macromicro.serve.shared import LINES

NAMES = tuple(name for name in LINES if name != "index_count")


def packed(axes: Sequence[Mapping[str, float]]) -> float:
    found, place = 0, 0
    for lines in axes:
        for name in NAMES:
            if name in lines:
                found |= (1 | (2 if lines[name] != 0.0 else 0)) << place
            place += 2
    return float(found)


def told(number: float) -> tuple[tuple[str, bool], ...]:
    """The lines of both axes, as `snapshot.Snapshot.lines`."""
    bits, found = int(number), []
    for axis in AXES:
        for name in NAMES:
            if bits & 1:
                found.append((f"{axis}_{name}", bool(bits & 2)))
            bits >>= 2
    return tuple(found)
