"""Switches and drive lines of two axes as one number, for the status in the shared memory.

Those of one axis are columns of the telemetry; the lamps of two need no record of their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from macromicro.control.live.messages import AXES
from macromicro.serve.shared import LINES

NAMES = tuple(name for name in LINES if name != "index_count")


def packed(axes: Sequence[Mapping[str, float]]) -> float:
    """The lines of both axes, by name; a line that there is not is left out.

    Parameters
    ----------
    axes : Sequence[Mapping[str, float]]
        Of each axis, 0 or 1 by the names in `NAMES`; anything but 0 is on, NaN too.

    Returns
    -------
    float
        A whole number: two bits a line, whether it is there and whether it is on.
    """
    found, place = 0, 0
    for lines in axes:
        for name in NAMES:
            if name in lines:
                found |= (1 | (2 if lines[name] != 0.0 else 0)) << place
            place += 2
    return float(found)


def told(number: float) -> tuple[tuple[str, bool], ...]:
    """The lines of both axes, as `snapshot.Snapshot.lines`.

    Parameters
    ----------
    number : float
        Of `packed`.

    Returns
    -------
    tuple[tuple[str, bool], ...]
        Names with the axis in front, such as "y_limit_low", and whether each is on.
    """
    bits, found = int(number), []
    for axis in AXES:
        for name in NAMES:
            if bits & 1:
                found.append((f"{axis}_{name}", bool(bits & 2)))
            bits >>= 2
    return tuple(found)
