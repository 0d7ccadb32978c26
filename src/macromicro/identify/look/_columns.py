"""One column of a file: range, resolution and anomalies that are beyond doubt."""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.picking import railed

_TURNS = {
    **{"deg": (360.0,), "rad": (2.0 * math.pi,), "rev": (1.0,)},
    "counts": tuple(2.0**k for k in range(8, 33)),
}
_TURNS[""] = (*_TURNS["deg"], *_TURNS["rad"], *_TURNS["counts"])
_JUMP = 0.8  # of the range: what wraps falls by so much at least
_SLOW = 0.1  # of the range: usual steps are smaller, or there is no telling
_ALIKE = 3.0  # the rate behind a wrap is within this factor of the rate before it
_CHATTER = 5  # rows
_SURE = 0.9  # of the jumps are those of one motion
_NEAR = 0.02  # of a full range: a sensor comes so near to both of its ends
_ROUGH = 1e-3  # of a usual step: smoother signals are no measurements


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
    remarks = [*wrapped(good, unit), *saturated(good)]
    step = float(steps[steps > 0.0].min())
    return Seen(name, unit, reason, low, high, missing, step, tuple(remarks))


def wrapped(values: Array, unit: str) -> list[str]:
    """A counter or an angle that passes the end of its range and goes on at the other end."""
    extent, steps = float(np.ptp(values)), np.diff(values)
    jumps = np.flatnonzero(np.abs(steps) > _JUMP * extent)
    moving = np.abs(steps[steps != 0.0])
    usual = float(np.median(moving)) if len(moving) else 0.0
    if not len(jumps) or usual > _SLOW * extent:
        return []
    gaps = np.diff(jumps)  # noise at an end of the range makes jumps to and fro
    alone = np.r_[True, gaps > _CHATTER] & np.r_[gaps > _CHATTER, True]
    for turn in _turns(values, unit, np.abs(steps[jumps]) + usual):
        good = [_goes_on(steps, int(k), jumps, turn) for k in jumps[alone]]
        if good and np.mean(good) >= _SURE:
            times = f"{len(jumps)} time{'s' * (len(jumps) != 1)}"
            return [f"wraps {times} at {turn:g}, first in row {jumps[0] + 2}"]
    return []


def _turns(values: Array, unit: str, sizes: Array) -> list[float]:
    """Full ranges that the values nearly fill; of a counter without a usual one, its own."""
    extent = float(np.ptp(values))
    found = [turn for turn in _TURNS.get(unit, ()) if (1.0 - _NEAR) * turn <= extent <= turn]
    whole = unit in ("", "counts") and bool(np.all(values == np.round(values)))
    if not found and whole and len(sizes) > 2 and values.min() == 0.0 and extent > 50.0:
        found = [float(round(float(np.median(sizes))))]
    return found


def _goes_on(steps: Array, k: int, jumps: npt.NDArray[np.int64], turn: float) -> bool:
    """Whether the speeds before and behind a jump, and the step across, are of one motion."""
    width = max(_CHATTER, len(steps) // 50)
    place = int(np.searchsorted(jumps, k))
    first = max(k - width, jumps[place - 1] + 1 if place else 0)
    last = min(k + width + 1, jumps[place + 1] if place + 1 < len(jumps) else len(steps))
    if first == k or last == k + 1:
        return False
    before, after = float(np.mean(steps[first:k])), float(np.mean(steps[k + 1 : last]))
    low, high = sorted((abs(before), abs(after)))
    across = steps[k] - math.copysign(turn, steps[k]) - 0.5 * (before + after)
    usual = max(float(np.abs(steps[first:k]).max()), float(np.abs(steps[k + 1 : last]).max()))
    against = before * steps[k] < 0.0 and after * steps[k] < 0.0
    return bool(against and high <= _ALIKE * low and abs(across) <= 2.0 * usual)


def saturated(values: Array) -> list[str]:
    """A sensor that stays at an end of its range where its signal, not a smooth one, goes on."""
    bends, steps = np.abs(np.diff(values, 2)), np.abs(np.diff(values))
    moving = bends[(steps[1:] > 0.0) & (steps[:-1] > 0.0)]
    if not len(moving) or np.median(moving) <= _ROUGH * float(np.median(steps[steps > 0.0])):
        return []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SaturationWarning)
        try:
            railed(values, "", "")
        except InputError as error:
            return [str(error.value)]
    texts = [str(w.message) for w in caught]
    return [text.removeprefix(": ").partition(", as those")[0] + ": saturated" for text in texts]
