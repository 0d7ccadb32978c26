"""Output error with elastic friction that depends on the position: `presliding_drive`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import _axis_noise, _axis_spread, _axis_thin, coverage
from macromicro.identify._axis_refine import begun, noisy, piece
from macromicro.identify._central import central
from macromicro.identify._presliding_choice import NODES, asked_for, chosen, named
from macromicro.identify._presliding_force import disturbed
from macromicro.identify._presliding_search import (
    Problem,
    Shape,
    bounds,
    nudges,
    pieces_of,
    problem_of,
    searched,
)
from macromicro.identify._ripple import Ripple
from macromicro.identify.axis_fit import drive, rows_of, runs_of
from macromicro.identify.axis_inverse import Estimate, Rows
from macromicro.identify.driven import Driven
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.presliding import FRICTIONS, Presliding, simulate

_ELASTIC = ("stiffness", "settling", "share")
_POSITIVE = ("stiffness", "settling", "stribeck_speed")  # uncertain by tens of percent
_NEARLY = 1000.0  # times the noise of the position: a fit by measured starts, to be taken further
_MOST = 60_000  # samples; of longer records evenly spread parts are fitted


@dataclass(frozen=True)
class PreslidingFit:
    """Result of `presliding_drive`; x is the unit of position, and force is `gain` times u."""

    friction: str  # "lugre" or "gms"
    model: Presliding  # the axis
    names: tuple[str, ...]  # its parameters, one by one: scalars, then `share k` and `level k`
    values: Array
    std: Array  # standard errors; NaN for what the record does not show
    factors: Array  # coverage factors (`coverage.factors`) of these
    # RMS of free runs over held-out pieces of a typical piece, by what was tried
    judged: dict[str, float]
    reasons: dict[str, str]  # why each one but the last was not taken
    taken: str  # key of what was taken
    rms: float  # of the free run over all records, unit of x
    # positions of the axis over each whole record, from its measured start
    free_run: tuple[Array, ...]
    residuals: tuple[Array, ...]  # measured position less free run
    gain: float  # force per unit of u
    delay: int  # samples by which u acts late
    # A force that repeats along the way and is not in the model, where there is one
    repeats: Ripple | None = None
    limit: float | None = None  # u saturates there

    def simulate(self, u: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
        driven = Driven(self.gain, self.limit, self.delay)
        return simulate(self.model, driven.force(np.asarray(u, np.float64)), dt, x, v)


def presliding_drive(
    t: npt.ArrayLike | Sequence[npt.ArrayLike],
    u: npt.ArrayLike | Sequence[npt.ArrayLike],
    x: npt.ArrayLike | Sequence[npt.ArrayLike],
    *,
    friction: str = "lugre",
    along: int | None = None,
    gain: float = 1.0,
    limit: float | None = None,
    delay: int = 0,
) -> PreslidingFit:
    """Parameters of an axis with LuGre or Maxwell-slip friction, from presliding motion."""
    if friction not in FRICTIONS:
        raise InputError("structure", friction, ", ".join(FRICTIONS))
    if along is not None and not 1 <= along <= NODES[-1]:
        raise InputError("along", along, f"nodes along the travel, 1 to {NODES[-1]}")
    rigid = drive(t, u, x, gain=gain, limit=limit, delay=delay)
    if "coulomb" not in rigid.refined.names:  # friction's give hid it; levels are told in it
        rigid = drive(t, u, x, gain=gain, limit=limit, delay=delay, structure="coulomb")
    records, driven = runs_of(t, u, x), Driven(gain, limit, delay)
    fitted = records
    if sum(len(r.t) for r in records) > _MOST:
        fitted = _axis_thin.stretches(records, _MOST // 5000, 5000)
    rows = rows_of(fitted, driven)
    problem = problem_of(rows, rigid.refined)
    z, shape, judged, reasons = chosen(problem, friction, along)
    asked = asked_for(friction, reasons)
    # Chosen by short pieces, fitted to those that rigid friction is fitted to.
    length = piece(rows, rigid.inverse, False)
    problem = problem._replace(pieces=pieces_of(rows, length))
    found = searched(problem, z, shape, 60)
    found = searched(problem, found.x, shape, 60, fine=True)
    # Starts are known as little as any sample; where forces disturb it, they would take these up.
    loose = problem._replace(pieces=pieces_of(rows, length, True))
    if noisy(np.concatenate(loose.missed(found.x, shape)), rows, _NEARLY):
        free = searched(loose, found.x, shape, 60, fine=True)
        if noisy(np.concatenate(loose.missed(free.x, shape)), rows):
            problem, found = loose, free
    if found.status == 0:
        notice(ConvergenceWarning, "elastic friction: not settled; the last values are returned")
    model = problem.model(found.x, shape)
    names, values = told(model, shape)
    spread, factors, repeats = _spread(problem, found.x, shape, rows, rigid.inverse)
    if not asked:
        spread[[n.startswith(_ELASTIC) for n in names]] = np.nan
    free, errors = [], []
    whole = rows
    if fitted is not records:
        whole = rows_of(records, driven)
    for one in whole:
        free.append(simulate(model, one.force, one.run.dt, *begun(one)))
        errors.append(one.run.x - free[-1])
    rms = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
    return PreslidingFit(
        friction,
        model,
        names,
        values,
        spread,
        factors,
        judged,
        reasons,
        named(shape),
        rms,
        tuple(free),
        tuple(errors),
        float(gain),
        int(delay),
        repeats,
        limit,
    )


def told(model: Presliding, shape: Shape) -> tuple[tuple[str, ...], Array]:
    names = list(shape.names)
    values = [float(getattr(model, n)) for n in names]
    for k, share in enumerate(model.shares, 1):
        names.append(f"share {k}")
        values.append(float(share))
    names += [f"level {k}" for k in range(1, shape.nodes + 1)]
    values += [float(v) for v in model.levels]
    return tuple(names), np.array(values)


def _spread(
    problem: Problem, z: Array, shape: Shape, rows: list[Rows], inverse: Estimate
) -> tuple[Array, Array, Ripple | None]:
    """Standard errors (NaN at a bound), coverage factors and the periodic force."""
    low, high, scale = bounds(z, shape)
    model = problem.model(z, shape)
    missed = problem.missed(z, shape)
    # Rigid friction's residuals hold the give of the friction, which is more than most forces are.
    # Along elastic friction's way forces show as they are, but nothing of short pieces.
    forces, taken, repeats = disturbed(problem, z, shape, missed)
    if forces:
        noise = _axis_noise.noise(rows, model, forces, taken)._replace(repeats=repeats)
    else:
        noise = _axis_noise.disturbance(rows, inverse)
    found = _axis_spread.covariance(
        problem.pieces, model, problem.slopes(z, shape), np.concatenate(missed), noise
    )

    def shown(at: Array) -> Array:
        return told(problem.model(at, shape), shape)[1]

    turn = central(shown, z, nudges(z, scale, False), low, np.full(len(z), np.inf))
    std = np.sqrt(np.diag(turn @ found.covariance @ turn.T))
    factors = coverage.factors(found.draws, turn)
    ended = (z <= low + 1e-3 * scale) | (z >= high - 1e-3 * scale)
    names = told(model, shape)[0]
    bound = [n for n, at in zip(shape.names, ended, strict=False) if at]
    if bound:
        notice(
            DataWarning,
            f"elastic friction: {', '.join(bound)} at a bound: the record does not determine "
            "it, so it has no standard error",
        )
    std[[names.index(n) for n in bound]] = np.nan
    draws = None if found.draws is None else found.draws @ turn.T
    for k in (names.index(n) for n in _POSITIVE if n in shape.names):
        own = None if draws is None else draws[:, k]
        factors[:, k] = coverage.positive(float(shown(z)[k]), float(std[k]), own)
    return std, factors, repeats
