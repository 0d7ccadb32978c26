"""Checks of what a drive's record cannot determine."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify.axis import Axis
from macromicro.identify.axis_inverse import Estimate, Rows
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.runs import Run

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
        large, said = _lost(run.x), "other steps differ from the one before by"
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


def _lost(x: Array) -> tuple[int, int, float] | None:
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
        raise ProblemError(
            "record",
            f"the mass is {mass:.4g} +- {error:.2g}: the force acts against the acceleration",
            "Check the signs of u, x and gain.",
        )


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


def mixed(names: Sequence[str], rows: Sequence[Rows]) -> None:
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
