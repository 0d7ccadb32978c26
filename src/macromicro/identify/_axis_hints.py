"""Choice of an axis' friction, and what its records show or hide beside it.

Friction, delay, limit and load are judged by the force error of inverse dynamics on blocks that
it was not fitted to.
"""

# Each record is cut into blocks, and a third of them is held out in turn, so that both parts show
# all directions and speeds. A richer structure has to be better by a share and by more than the
# blocks scatter.

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import clusters
from macromicro.identify.axis_inverse import (
    BLOCKS,
    HELD,
    STRUCTURES,
    Estimate,
    Rows,
    columns,
    decimate_rows,
    fit_structure,
    linear,
    plausible,
)
from macromicro.identify.engine import FOLDS, Judged, no_better, simplest, turn, typical
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, late

_STRANGE = 3.0  # standard errors by which what nobody spoke of must gain: several are looked for
_EXACT = 2e-3  # of the force: a model that misses by less has no such trouble
_MOST = 12  # blocks in a record
_LEAST = 40  # decimated samples in a block: its low-pass takes 20
# What stands in for a structure where a part of the record does not show it.
_POORER = {"coulomb": "viscous", "asymmetric": "coulomb", "stribeck": "coulomb", "full": "stribeck"}
_TOO_POOR = "the motion does not determine its parameters"
_NEGATIVE = "the mass or a friction is negative"
_ADDED = ("asymmetry", "stribeck")  # to Coulomb friction, by richer structures
ABOUT = "coulomb"  # the friction by which delays and limits are looked for
LATEST = 1000  # samples
_EARLY = 12  # samples by which delays are tried one by one, and by which a force may act early
_PART = 10  # a delay is at most so small a part of the shortest record
_ROUNDS, _HALF = 5, 0.5  # of the search for parts of a sample, and its differences, samples
_STEP, _FINE = 0.1, 21  # limits tried at first, parts of the largest force, and near the best
_LIMITS = np.arange(0.4, 1.0 + 0.5 * _STEP, _STEP)


def part(rows: Rows, where: slice) -> Rows:
    run = rows.run.part(where.start, where.stop)
    force, v, a = (each[where] for each in (rows.force, rows.v, rows.a))
    return rows._replace(run=run, force=force, v=v, a=a, still=rows.still[where])


def divide(record: Rows, count: int) -> list[Rows]:
    ends = np.linspace(0, len(record.v), count + 1).round().astype(int)
    return [part(record, slice(a, b)) for a, b in pairwise(ends)]


def blocks(rows: list[Rows]) -> list[Rows]:
    made = []
    for record in rows:
        longest = _LEAST * record.factor
        made += divide(record, max(min(_MOST, len(record.v) // longest), 1))
    return made


def folds(rows: list[Rows]) -> Iterator[tuple[list[Rows], list[Rows]]]:
    """Blocks to fit and blocks held out, by turns."""
    pieces = blocks(rows)
    turns = turn(np.arange(len(pieces)))
    for k in range(min(FOLDS, len(pieces))):
        kept = [p for p, at in zip(pieces, turns, strict=True) if at != k]
        yield kept, [p for p, at in zip(pieces, turns, strict=True) if at == k]


def choose_structure(rows: list[Rows]) -> Judged:
    """The simplest structure that no richer one beats on held-out data."""
    squares: dict[str, Array] = {}
    reasons: dict[str, str] = {}
    for name in STRUCTURES:
        found = held_out(rows, name)
        if isinstance(found, str):
            reasons[name] = found
        else:
            squares[name] = found
    if squares:
        judged = simplest(squares, reasons)
        while len(squares) > 1 and (why := _unsure(rows, judged.structure)):
            del squares[judged.structure]
            reasons[judged.structure] = why
            judged = simplest(squares, reasons)
        ordered = {n: judged.reasons[n] for n in STRUCTURES if n in judged.reasons}
        return judged._replace(reasons=ordered)
    if (
        reasons["viscous"] == _NEGATIVE
        and fit_structure(rows, "viscous", errors=False).axis.mass < 0.0
    ):
        problem = "the mass is negative: the force acts against the acceleration"
        remedy = "Check the signs of u, x and gain, whether x wraps, and the sample time."
        raise ProblemError("record", problem, remedy)
    problem = "; ".join(f"{name}: {why}" for name, why in reasons.items())
    remedy = "Record accelerated motion in both directions at several speeds."
    raise ProblemError("record", problem, remedy)


def held_out(rows: list[Rows], name: str) -> Array | str:
    """Squared force errors of a structure in blocks held out."""
    # If the fitted blocks do not determine what a structure adds, or give it a negative sign, the
    # next simpler structure predicts the held-out ones: these may hold the only reverse or slow
    # motion.
    whole = _fit(rows, name)
    if isinstance(whole, str):
        return whole
    squares = []
    for train, test in folds(rows):
        estimate: Estimate | str = _fit(train, name)
        at = name
        while isinstance(estimate, str) and at in _POORER:
            at = _POORER[at]
            estimate = _fit(train, at)
        if isinstance(estimate, str):
            return estimate
        missed = [r for r in _force_residuals(test, estimate) if len(r)]
        squares += [float(np.mean(r**2)) for r in missed]
    return np.array(squares) if squares else _TOO_POOR


def _fit(rows: list[Rows], name: str) -> Estimate | str:
    try:
        estimate = fit_structure(rows, name, errors=False)
    except InputError:
        return _TOO_POOR
    return estimate if plausible(estimate) else _NEGATIVE


def _unsure(rows: list[Rows], structure: str) -> str:
    """Why a structure is not taken: a term that it adds is smaller than its error. Or ""."""
    found = fit_structure(rows, structure)
    for name, value, error in zip(found.names, found.values, found.std, strict=True):
        if name in _ADDED and error > abs(value):
            return f"the standard error of its {name} exceeds the value"
    return ""


def _force_residuals(rows: list[Rows], estimate: Estimate) -> list[Array]:
    names = linear(estimate.names)
    theta = np.array([getattr(estimate.axis, n) for n in names])
    tables = (columns(r, names, estimate.axis.stribeck_speed) for r in rows)
    return [table[:, -1] - table[:, :-1] @ theta for table in tables]


def lowered_by(rows: list[Rows], other: list[Rows], structure: str) -> float | None:
    """Share by which alternative records lower the force error in held-out blocks."""
    one, another = held_out(rows, structure), held_out(other, structure)
    if isinstance(another, str):
        return None
    if isinstance(one, str):
        return 1.0 if one == _NEGATIVE else None
    power = [sum(float(r.force @ r.force) for r in each) for each in (rows, other)]
    another = another * (power[0] / power[1])
    score, richer = typical(one), typical(another)
    if score < _EXACT * (power[0] / sum(len(r.force) for r in rows)) ** 0.5:
        return None
    why_not = no_better(score, richer, np.log(one / another), structure, _STRANGE)
    return None if why_not else 1.0 - richer / score


def _gain(part: float) -> str:
    if part == 1.0:
        return "alone gives a positive mass and friction"
    return f"lowers the force error by {100.0 * part:.0f} % on held-out data"


def shift(force: Array, samples: int) -> Array:
    """A held force delayed by whole samples, or advanced if negative."""
    if samples >= 0:
        return late(force, samples)
    return np.concatenate([force[-samples:], np.full(min(-samples, len(force)), force[-1])])


def delay_samples(rows: list[Rows], samples: int) -> list[Rows]:
    """The records with their force late by samples of the first one."""
    step = rows[0].run.dt
    by = [round(samples * step / r.run.dt) for r in rows]
    return [r._replace(force=shift(r.force, many)) for r, many in zip(rows, by, strict=True)]


def delay(rows: list[Rows], least: int = 0) -> int:
    """The delay with the smallest residual force, by a coarse search and its neighbours."""
    most = min(LATEST, min(len(r.v) for r in rows) // _PART)
    tried = [*range(least, min(_EARLY, most) + 1)]
    while tried[-1] < most:
        tried.append(min(tried[-1] + tried[-1] // 4, most))
    best = _best(rows, tried)
    at = tried.index(best)
    low, high = tried[max(at - 1, 0)], tried[min(at + 1, len(tried) - 1)]
    return _best(rows, range(low, high + 1))


def _best(rows: list[Rows], tried: Iterable[int]) -> int:
    parts = [columns(r, STRUCTURES[ABOUT], 1.0, forced=False) for r in rows]
    basis = np.linalg.qr(np.concatenate(parts))[0]

    def left(samples: int) -> float:
        force = np.concatenate(_forces(delay_samples(rows, samples), 0.0))
        whole = float(force @ force)
        return float(np.sum((force - basis @ (basis.T @ force)) ** 2)) / (whole or 1.0)

    return min(tried, key=left)


def lag(rows: list[Rows]) -> tuple[float, float]:
    """The delay in fractions of a sample, and its standard error, s, by least squares."""
    parts = [columns(r, STRUCTURES[ABOUT], 1.0, forced=False) for r in rows]
    found, error, dt = delay(rows) * rows[0].run.dt, 0.0, max(r.run.dt for r in rows)
    for _ in range(_ROUNDS):
        before = min(found, _HALF * dt)
        first, last = (_forces(lag_force(rows, found + by), 0.0) for by in (-before, _HALF * dt))
        slope = (np.concatenate(last) - np.concatenate(first)) / (before + _HALF * dt)
        table = np.c_[np.concatenate(parts), -slope]
        force = np.concatenate(_forces(lag_force(rows, found), 0.0))
        theta = np.linalg.lstsq(table, force, rcond=None)[0]
        edges = clusters.blocks(len(force), BLOCKS)
        spread = clusters.spread(table, force - table @ theta, edges)
        error = float(np.sqrt(spread.covariance[-1, -1]))
        found = max(found + float(np.clip(theta[-1], -dt, dt)), 0.0)
    return found, error


def _forces(rows: list[Rows], samples: float) -> list[Array]:
    pushed = [late(r.force, HELD + samples) for r in rows]
    return [decimate_rows(r, [push], [True])[:, 0] for r, push in zip(rows, pushed, strict=True)]


def lag_force(rows: list[Rows], lag: float) -> list[Rows]:
    return [r._replace(force=late(r.force, lag / r.run.dt)) for r in rows]


def limit(rows: list[Rows]) -> float:
    """The force limit with the smallest residual of inverse dynamics."""
    most = max(float(np.abs(r.force).max()) for r in rows)
    best = min(_LIMITS, key=lambda part: _residual_of_limit(rows, part * most))
    near = np.linspace(max(best - _STEP, _STEP), min(best + _STEP, 1.0), _FINE)
    return most * float(min(near, key=lambda part: _residual_of_limit(rows, float(part) * most)))


def _residual_of_limit(rows: list[Rows], most: float) -> float:
    """Squared residual share of a limited force."""
    table = np.concatenate([columns(r, STRUCTURES[ABOUT], 1.0) for r in limit_force(rows, most)])
    force = table[:, -1]
    missed = force - table[:, :-1] @ np.linalg.lstsq(table[:, :-1], force, rcond=None)[0]
    return float(missed @ missed) / (float(force @ force) or 1.0)


def limit_force(rows: list[Rows], most: float) -> list[Rows]:
    return [r._replace(force=np.clip(r.force, -most, most)) for r in rows]


def warn_of_hints(rows: list[Rows], gain: float) -> None:
    late = _shown_late(rows)
    rows = late or rows
    most = limit(rows)
    cut = limit_force(rows, most)
    lowered = lowered_by(rows, cut, ABOUT)
    if lowered is None:
        return
    found = f"the force seems to saturate at u = {most / abs(gain):.3g}"
    remedy = (
        "If the amplifier saturates, --limit (`limit`) finds the limit; drag that grows "
        "faster than the speed looks alike"
    )
    _warn(found, lowered, remedy)
    if late is None:  # a limit may hide a delay
        _shown_late(cut)


def _shown_late(rows: list[Rows]) -> list[Rows] | None:
    """Warn of a late force; returns the shifted records then."""
    samples = delay(rows, -_EARLY)
    other = delay_samples(rows, samples)
    # At the end of what is tried it is no shift of the columns.
    within = samples and samples != -_EARLY
    lowered = lowered_by(rows, other, ABOUT) if within else None
    if lowered is None:
        return None
    _late(samples, rows[0].run.dt, lowered)
    return other


def _late(samples: int, dt: float, lowered: float) -> None:
    way = "later" if samples > 0 else "earlier"
    many = abs(samples)
    count = f"{many} sample{'s' * (many > 1)}"
    found = f"the force acts {many * dt * 1e3:.4g} ms ({count}) {way} than u"
    remedy = (
        'If there is a delay, or a lag of driver or filter, --delay fit (`delay="fit"`) identifies '
        "it with the parameters"
        if samples > 0
        else "If u and x were recorded by two clocks, or u is filtered, shift one of them"
    )
    _warn(found, lowered, remedy)


def _warn(found: str, lowered: float, remedy: str) -> None:
    notice(
        DataWarning,
        f"{found}: this {_gain(lowered)}, and the parameters are wrong by more "
        f"than their errors. {remedy}",
    )


def gravity_share(rows: Sequence[Rows], structure: str) -> float | None:
    """Share of the force error that gravity on an eccentric load would explain."""
    hung = [r._replace(eccentric=True) for r in rows]
    return lowered_by(list(rows), hung, structure)


def warned_of_load(rows: Sequence[Rows], structure: str) -> None:
    lowered = gravity_share(rows, structure)
    if lowered is not None:
        notice(
            DataWarning,
            f"a torque proportional to the sine of the angle {_gain(lowered)}. If "
            "the load is eccentric on a horizontal shaft, --eccentric (`eccentric=True`) "
            "identifies gravity on it",
        )


_FAR = 5.0  # a jump is that many times as large as any other step
_JUMPS = 0.02  # of the samples at most
_SURE = 2.0  # standard errors
_ALIKE = 0.01  # of a parameter: a difference that nobody minds
_SLOW = 0.01  # of the greatest speed
_REFUSED, _COARSE = 1.5, 4.0  # samples in the time constant


def jumps(run: Run, where: str) -> None:
    """Reject a position that jumps: a counter that wraps, or missing rows."""
    large, said = _apart(run.x), "all other steps are"
    if large is None:
        large, said = _lost_counts(run.x), "other steps differ from the one before by"
    if large is None:
        return
    many, at, rest = large
    raise ProblemError(
        f"{where}, row {at + 2}",
        f"the position jumps by {run.x[at + 1] - run.x[at]:.6g} ({many} such jumps; {said} "
        f"{rest:.3g} at most)",
        "Unwrap the counter, or cut the record there.",
    )


def _apart(x: Array) -> tuple[int, int, float] | None:
    """Number of outlying steps, the first one and the largest other step; None without a gap."""
    top = _largest(np.diff(x), int(_JUMPS * (len(x) - 1)))
    apart = np.flatnonzero(top[:-1] > _FAR * top[1:])
    if not len(apart) or top[apart[-1] + 1] == 0.0:
        return None
    many = int(apart[-1]) + 1
    first = int(np.argmax(np.abs(np.diff(x)) >= top[many - 1]))
    return many, first, float(top[many])


def _largest(values: Array, count: int) -> Array:
    """The `count` + 1 largest sizes in falling order; overwrites the values."""
    np.abs(values, out=values)
    values.partition(len(values) - count - 1)  # in place, for records may be long
    return np.sort(values[-count - 1 :])[::-1]


def _lost_counts(x: Array) -> tuple[int, int, float] | None:
    """As `_apart`, for counts lost in motion: steps that differ from both neighbours."""
    count = int(_JUMPS * (len(x) - 1))
    most = _largest(np.diff(x, 2), 2 * count)
    if most[0] <= _FAR * most[-1]:  # each jump changes two
        return None
    change = np.diff(x, 2)
    off = np.zeros(len(x) - 1)
    both = np.minimum(np.abs(change[:-1]), np.abs(change[1:]))
    off[1:-1] = np.where(change[:-1] * change[1:] < 0.0, both, 0.0)
    top = _largest(off.copy(), count)
    apart = np.flatnonzero(top[:-1] > _FAR * top[1:])
    if not len(apart):
        return None
    jumps = np.flatnonzero(off >= top[apart[0]])
    beside = np.zeros(len(change), dtype=bool)
    beside[jumps - 1] = beside[jumps] = True
    rest = float(np.abs(change[~beside]).max(initial=0.0))
    far = 0.0 < _FAR * rest < top[apart[0]]
    return (len(jumps), int(jumps[0]), rest) if far else None


def against(estimate: Estimate) -> None:
    mass, error = estimate.axis.mass, float(estimate.std[estimate.names.index("mass")])
    if mass + _SURE * error < 0.0:
        problem = f"the mass is {mass:.4g} +- {error:.2g}: the force acts against the acceleration"
        raise ProblemError("record", problem, "Check the signs of u, x and gain.")


def coarse(axes: Sequence[Axis], dt: float) -> None:
    """Reject, or warn of, a sample time that is too long for the axis."""
    times = [axis.mass / axis.viscous for axis in axes if axis.viscous > 0.0]
    least = min((t for t in times if t > 0.0), default=math.inf)
    found = f"the sample time is {dt * 1e3:.4g} ms, the time constant M/Fv {least * 1e3:.3g} ms"
    if least < _REFUSED * dt:
        raise ProblemError("record", found, "Record six samples or more per time constant.")
    if least < _COARSE * dt:
        notice(
            DataWarning,
            f"{found}: the mass is more uncertain than its standard error; sample faster",
        )


def warn_of_mixture(names: Sequence[str], rows: Sequence[Rows]) -> None:
    if len(directions(np.concatenate([r.v for r in rows]))) == 1 and "coulomb" not in names:
        notice(
            DataWarning,
            "motion in one direction only: Coulomb friction and a constant force cannot be "
            "separated; offset is their sum",
        )


def apart(inverse: Estimate, refined: Estimate) -> None:
    """Warn of two methods that differ by more than both their 95 % intervals."""
    # After J. Hausman, Econometrica 46 (1978): of an axis like the model they agree.
    at = [refined.names.index(name) for name in inverse.names]
    off = np.abs(inverse.values - refined.values[at])
    both = inverse.std * inverse.factors[1] + (refined.std * refined.factors[1])[at]
    is_far = (off > both) & (off > _ALIKE * np.abs(inverse.values))
    far = np.array(inverse.names)[is_far].tolist()
    if far:
        notice(
            DataWarning,
            f"inverse dynamics and output error differ in {', '.join(far)} by more than their "
            "errors: the axis is not what the model says (friction that varies along the travel "
            "or gives before it slides, a spring, another force)",
        )


def directions(v: Array, least: float = 0.0) -> set[float]:
    """Directions in which the axis exceeds 1 % of its greatest speed."""
    going = np.sign(v[np.abs(v) > _SLOW * np.abs(v).max()])
    return {way for way in (1.0, -1.0) if np.sum(going == way) > least * len(going)}
