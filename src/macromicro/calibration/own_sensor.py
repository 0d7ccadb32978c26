"""What a stage's own sensor shows without a reference: backlash by a reversal test, and cogging."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from macromicro.arrays import Array
from macromicro.calibration import efforts, measuring, procedure, targets
from macromicro.calibration.procedure import Request, Ripple
from macromicro.control.correction import Correction
from macromicro.errors import ProblemError
from macromicro.machines import planning
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import MOVING
from macromicro.place import of as place_of

REVERSALS = 8
WAY = 60  # counts that a slow motion goes on after a reversal, at least
FARTHEST = 0.01  # of the travel
SLOWER = 0.1  # than a pass along the travel: the law takes its effort back within the backlash
FREE = 0.5  # share of the later effort below which the drive still crosses its backlash
SCATTER = 0.5  # greatest standard deviation of the reversals, of their mean


class Backlash(NamedTuple):
    value: float  # m
    half: float  # half width of its 95 % interval, m


class Own(NamedTuple):
    """What was found without a reference."""

    request: Request
    settings: Any  # with the corrections
    backlash: Backlash | None  # None: not shown
    ripple: tuple[Ripple, ...]
    remarks: tuple[str, ...]


def measure(request: Request) -> Own:
    """Backlash from reversals, and with `cogging` efforts along the travel from slow passes."""
    if not isinstance(request.machine, Machine):
        problem = "without a reference only a machine of one stage can be measured"
        raise ProblemError("--reference none", problem, "Give the file of a single stage.")
    machine, settings = procedure.without_corrections(request.machine, request.settings)
    assert isinstance(machine, Machine)
    found, remarks = backlash(machine, settings, request), []
    low, high = float(settings.travel.low), float(settings.travel.high)
    changes: dict[str, Any] = {"low": low, "high": high}
    if found is None:
        remarks.append(
            "the efforts after reversals show no backlash: with little friction at the load it "
            "takes a reference"
        )
    else:
        half = 0.5 * found.value
        changes |= {"up": (-half, -half), "down": (half, half)}
    _, settings = procedure.with_corrections(machine, settings, [Correction(**changes)])
    made = Own(request, settings, found, (), tuple(remarks))
    return with_cogging(made) if request.cogging else made


def with_cogging(found: Own) -> Own:
    settings, ripple, remarks = procedure.learned_efforts(found.request, found.settings)
    return found._replace(settings=settings, ripple=(ripple,), remarks=(*found.remarks, *remarks))


def backlash(machine: Machine, settings: Any, request: Request) -> Backlash | None:
    """How far the drive goes after a reversal before it meets its load; None: it does not show."""
    pitch, span = float(settings.encoder.pitch), targets.span(settings)
    way = max(WAY * pitch, FARTHEST * (span[1] - span[0]))
    place = place_of(settings)
    speed, fast = SLOWER * efforts.slow(settings), settings.motion.velocity
    ends: list[tuple[float, float]] = []
    for begin in np.linspace(span[0] + way, span[1] - 2.0 * way, REVERSALS).tolist():
        ends += [(begin, fast), (begin + way, speed), (begin, speed)]
    plan = planning.stops(ends, targets.HOLD, settings, "the reversals")
    how: dict[str, Any] = {"seed": request.seed, "bench": request.bench, "rigs": request.rigs}
    found = measuring.record(machine, settings, plan, "the reversals", **how)
    wanted = ("move", "phase", "reading", "effort")
    move, phase, reading, effort = (found[name] for name in wanted)
    gaps = []
    for k in range(REVERSALS):
        own = (move == 3 * k + 2) & (phase == MOVING)
        gap = _free_way(np.abs(reading[own] - reading[own][0]) / place.per, effort[own], way)
        if gap is not None:
            gaps.append(gap)
    if len(gaps) < REVERSALS // 2 + 1:
        return None
    mean, spread = float(np.mean(gaps)), float(np.std(gaps, ddof=1))
    if mean < 3.0 * pitch or spread > SCATTER * mean:
        return None
    half = float(stats.t.ppf(0.975, len(gaps) - 1)) * spread / math.sqrt(len(gaps))
    return Backlash(mean, half + 0.5 * pitch)


def _free_way(gone: Array, effort: Array, way: float) -> float | None:
    """The distance after which the effort has risen half the way to what it is later on."""
    later = gone > 0.6 * way
    if later.sum() < 10:
        return None
    edges = np.linspace(0.0, float(gone.max()), 61)
    index = np.clip(np.digitize(gone, edges) - 1, 0, 59)
    counts = np.bincount(index, minlength=60)
    means = np.bincount(index, weights=effort, minlength=60) / np.maximum(counts, 1)
    plateau = float(np.median(effort[later]))
    share = means[counts > 0] / plateau
    middles = (0.5 * (edges[:-1] + edges[1:]))[counts > 0]
    pushes = np.flatnonzero(share > FREE)
    if plateau == 0.0 or not pushes.size or pushes[0] == 0:
        return None
    first = int(pushes[0])
    below, above = share[first - 1], share[first]
    part = (FREE - below) / (above - below)
    return float(middles[first - 1] + part * (middles[first] - middles[first - 1]))
