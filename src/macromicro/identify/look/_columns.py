"""One column of a file: range, resolution and anomalies."""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.picking import railed

_TURNS = (360.0, 2.0 * math.pi, 100.0, *(2.0**k for k in (8, 10, 12, 14, 16, 20, 24, 32)))


class Seen(NamedTuple):
    # name, unit, reason: as in the file; the unit, and where it is from
    name: str
    unit: str
    reason: str
    low: float = math.nan  # least and greatest value
    high: float = math.nan  # NaN where it holds no numbers
    missing: int = 0  # rows without a finite number
    step: float = math.nan  # smallest difference of two rows that differ; NaN where none do
    remarks: tuple[str, ...] = ()  # anomalies, in words


def seen(name: str, unit: str, reason: str, values: Array) -> Seen:
    good = values[np.isfinite(values)]
    missing = len(values) - len(good)
    if not len(good):
        return Seen(name, unit, reason, missing=missing, remarks=("no number in any row",))
    low, high = float(good.min()), float(good.max())
    if low == high:
        return Seen(name, unit, reason, low, high, missing, remarks=("constant",))
    steps = np.abs(np.diff(good))
    remarks = [*wrapped(good), *saturated(good)]
    step = float(steps[steps > 0.0].min())
    return Seen(name, unit, reason, low, high, missing, step, tuple(remarks))


def wrapped(values: Array) -> list[str]:
    extent, steps = float(np.ptp(values)), np.diff(values)
    jumps = np.flatnonzero(np.abs(steps) > 0.8 * extent)
    moving = np.abs(steps[steps != 0.0])
    usual = float(np.median(moving)) if len(moving) else 0.0
    if not len(jumps) or usual > 0.25 * extent:
        return []
    # A counter that wraps goes on in the direction in which it came; a square wave does not.
    sides = [steps[k + d] for k in jumps for d in (-1, 1) if 0 <= k + d < len(steps)]
    ways = [steps[k] for k in jumps for d in (-1, 1) if 0 <= k + d < len(steps)]
    against = [s * w < 0.0 for s, w in zip(sides, ways, strict=True)]
    if sum(against) <= 0.5 * len(against):
        return []
    size = float(np.abs(steps[jumps]).max()) + usual
    turn = min(_TURNS, key=lambda t: abs(math.log(t / size)))
    near = f", perhaps at {turn:g}" if abs(turn / size - 1.0) < 0.1 else ""
    return [f"wraps {len(jumps)} times{near}, first in row {jumps[0] + 2}"]


def saturated(values: Array) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SaturationWarning)
        try:
            railed(values, "", "")
        except InputError as error:
            return [str(error.value)]
    texts = [str(w.message) for w in caught]
    return [text.removeprefix(": ").partition(", as those")[0] + ": saturated" for text in texts]
