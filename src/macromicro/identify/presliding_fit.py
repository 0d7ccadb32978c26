"""Output error with elastic friction that depends on the position: `presliding_drive`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import _axis_long, _moved_mass, clusters
from macromicro.identify._elastic import ELASTIC, NODES, Candidate, chosen
from macromicro.identify._engine import fit, settled
from macromicro.identify._moved_mass import Model
from macromicro.identify._ripple import Ripple
from macromicro.identify.axis import Axis
from macromicro.identify.axis_fit import DriveFit, drive, runs_of
from macromicro.identify.driven import Driven
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.presliding import FRICTIONS, Presliding, simulate

_ELASTIC = ("stiffness", "settling", "share")
_MOST, _PART = 30_000, 5000  # samples; of longer records evenly spread parts are fitted


@dataclass(frozen=True)
class PreslidingFit:
    """Result of `presliding_drive`; x is the unit of position, and force is `gain` times u."""

    friction: str  # "lugre" or "gms"
    model: Presliding  # the axis
    names: tuple[str, ...]  # its parameters, one by one: scalars, then `share k` and `level k`
    values: Array
    std: Array  # standard errors; NaN for what the record does not show
    factors: Array  # coverage factors of the 68 and 95 % intervals of these, shape (2, p)
    # RMS of free runs over held-out pieces of a typical piece, by what was tried
    judged: dict[str, float]
    reasons: dict[str, str]  # why each one but the last was not taken
    taken: str  # key of what was taken
    rms: float  # of the free run over all records, unit of x
    # positions of the axis over each whole record, from its fitted start
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
    rigid = _rigid(t, u, x, gain=gain, limit=limit, delay=delay)
    driven = Driven(gain, limit, delay)
    records = [run._replace(u=driven.force(run.u)) for run in runs_of(t, u, x)]
    fitted = records
    if sum(len(r.t) for r in records) > _MOST:
        fitted = _axis_long.stretches(records, _MOST // _PART, _PART)
    names = tuple(n for n in rigid.refined.names if n != "lag")
    found = chosen(fitted, Model(names), rigid.axis, friction, along)
    kind, near = found.best
    end = fit(kind.simulated, near.space, near.pieces, near.values)
    if not end.settled:
        notice(ConvergenceWarning, "elastic friction: not settled; the last values are returned")
    model, values = kind.model(end.values), kind.parameters(end.values)
    std, factors, repeats = _errors_of(Candidate(kind, end))
    if ELASTIC in found.reasons:
        notice(
            DataWarning,
            f"{friction} friction predicts held-out pieces no better than rigid friction, within "
            "their scatter: the record does not need it, and its elastic parameters have no "
            "standard errors",
        )
        std[[name.startswith(_ELASTIC) for name in values]] = np.nan
    whole = settled(kind.simulated, end.space, _moved_mass.pieces(records, 1, False), end.values)
    free = np.split(kind.simulated(end.values, whole), whole.edges[1:-1])
    errors = [r.x - run for r, run in zip(records, free, strict=True)]
    return PreslidingFit(
        friction,
        model,
        tuple(values),
        np.array(list(values.values())),
        std,
        factors,
        found.scores,
        found.reasons,
        kind.words,
        float(np.sqrt(np.mean(np.concatenate(errors) ** 2))),
        tuple(free),
        tuple(errors),
        float(gain),
        int(delay),
        repeats,
        limit,
    )


def _rigid(t: Any, u: Any, x: Any, **options: Any) -> DriveFit:
    found = drive(t, u, x, **options)
    if "coulomb" in found.refined.names:
        return found
    # The friction's give hid its level, which levels along the travel are relative to.
    return drive(t, u, x, structure="coulomb", **options)


def _errors_of(found: Candidate) -> tuple[Array, Array, Ripple | None]:
    """Standard errors (NaN at a bound), coverage factors and the force that repeats."""
    kind, end = found
    free = ~end.bound
    edges = _moved_mass.edges(end.pieces)
    spread = clusters.spread(end.slopes[:, free], end.residual, edges)
    model = kind.model(end.values)
    seen = _moved_mass.Found(end, _moved_mass.widened(spread, free))
    repeats = _moved_mass.repeated(end, kind.simulated, Axis(model.mass, model.viscous))
    if repeats is not None:
        seen = _moved_mass.under(seen, kind.simulated, repeats)
    names = list(kind.parameters(end.values))
    turn = _turn(found)
    covariance = np.nan_to_num(seen.spread.covariance)
    std = np.sqrt(np.diag(turn @ covariance @ turn.T))
    ended = [n for n, at in zip(end.space.names, end.bound, strict=True) if at and n in names]
    if ended:
        notice(
            DataWarning,
            f"elastic friction: {', '.join(ended)} at a bound: the record does not determine "
            "it, so it has no standard error",
        )
        std[[names.index(n) for n in ended]] = np.nan
    return std, seen.spread.factors(turn), repeats


def _turn(found: Candidate) -> Array:
    """Derivatives of the parameters by those of the search."""
    kind, z = found.kind, found.end.values
    step = 1e-6 * np.maximum(np.abs(z), 1e-3)

    def values(at: Array) -> Array:
        return np.array(list(kind.parameters(at).values()))

    columns = [
        (values(z + one) - values(z - one)) / (2.0 * h)
        for one, h in zip(np.diag(step), step, strict=True)
    ]
    return np.stack(columns, axis=1)
