"""What a record of a drive cannot tell: said before numbers are printed that mean nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.axis_inverse import Estimate, Rows
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.runs import Run

_FAR = 5.0  # a jump is that many times as large as any other step
_JUMPS = 0.02  # of the samples at most
_SURE = 2.0  # standard errors
_ONE = 0.98  # correlation of errors
_SLOW = 0.01  # of the greatest speed
_REFUSED, _COARSE = 1.5, 4.0  # samples in the time constant


def jumps(run: Run, where: str) -> None:
    """Refuse a position that jumps: a counter that wraps, or rows that are missing.

    Parameters
    ----------
    run : Run
        As measured.
    where : str
        Record and column, for the message.

    Raises
    ------
    InputError
        Some steps are far larger than all others, or than the speed before and after them.
    """
    large, said = _apart(run.x), "all other steps are"
    if large is None:
        large, said = _lost(run.x), "other steps differ from the one before by"
    if large is None:
        return
    many, at, rest = large
    raise InputError(
        f"{where}, row {at + 2}",
        f"a jump by {run.x[at + 1] - run.x[at]:.6g}; {many} of them, {said} {rest:.3g} at most",
        "a position without jumps: unwrap the counter, or cut the record there",
    )


def _apart(x: Array) -> tuple[int, int, float] | None:
    """How many steps are far larger than all others, the first of these, and the largest of the
    others; None where no gap tells."""
    top = _largest(np.diff(x), int(_JUMPS * (len(x) - 1)))
    apart = np.flatnonzero(top[:-1] > _FAR * top[1:])
    if not len(apart) or top[apart[-1] + 1] == 0.0:
        return None
    many = int(apart[-1]) + 1
    first = int(np.argmax(np.abs(np.diff(x)) >= top[many - 1]))
    return many, first, float(top[many])


def _largest(values: Array, count: int) -> Array:
    """The largest sizes in falling order, one more than `count`; the values are overwritten."""
    np.abs(values, out=values)
    values.partition(len(values) - count - 1)  # in place, for records may be long
    return np.sort(values[-count - 1 :])[::-1]


def _lost(x: Array) -> tuple[int, int, float] | None:
    """As `_apart`, of steps that are off the step before and the one after by far more than these
    differ elsewhere: counts that were lost in motion. An impact is off on one side only."""
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
    """Refuse a force that acts against the motion.

    Parameters
    ----------
    estimate : Estimate
        By inverse dynamics.

    Raises
    ------
    InputError
        Its mass is below 0 by two standard errors.
    """
    mass, error = estimate.axis.mass, float(estimate.std[estimate.names.index("mass")])
    if mass + _SURE * error < 0.0:
        raise InputError(
            "record",
            f"a mass of {mass:.4g} +- {error:.2g}: the force acts against the acceleration",
            "a force that drives the motion: check the signs of u, x and gain",
        )


def coarse(estimates: Sequence[Estimate], dt: float) -> None:
    """Refuse samples too far apart for the axis, or warn.

    Parameters
    ----------
    estimates : Sequence[Estimate]
        By both methods.
    dt : float
        Sample time, s.

    Raises
    ------
    InputError
        The time constant M/Fv is shorter than one and a half samples: between two of them the
        axis has reached its speed, and its mass shows nowhere.
    """
    times = [e.axis.mass / e.axis.viscous for e in estimates if e.axis.viscous > 0.0]
    least = min((t for t in times if t > 0.0), default=math.inf)
    found = f"{dt * 1e3:.4g} ms between samples, a time constant M/Fv of {least * 1e3:.3g} ms"
    if least < _REFUSED * dt:
        accepted = "a record with six samples or more in a time constant"
        raise InputError("record", found, accepted)
    if least < _COARSE * dt:
        notice(DataWarning, f"{found}: the mass is uncertain beyond what is told; sample faster")


def mixed(estimate: Estimate, rows: Sequence[Rows]) -> None:
    """Say which parameters the record cannot tell apart.

    Parameters
    ----------
    estimate : Estimate
        As found.
    rows : Sequence[Rows]
        In what.
    """
    if len(directions(rows)) == 1 and "coulomb" not in estimate.names:
        notice(
            DataWarning,
            "motion in one direction only: Coulomb friction and a constant force cannot be "
            "separated; offset is their sum",
        )
    for a, b, correlation in correlated(estimate):
        notice(
            DataWarning,
            f"{a} and {b} cannot be separated in this record: their errors go together "
            f"(correlation {correlation:.3f}); the errors printed hold for both at once",
        )


def directions(rows: Sequence[Rows], least: float = 0.0) -> set[float]:
    """In which directions the axis goes, faster than 1 % of its greatest speed.

    Parameters
    ----------
    rows : Sequence[Rows]
        The records.
    least : float, optional
        For more than this part of the time in which it goes.

    Returns
    -------
    set[float]
        Of 1.0 and -1.0.
    """
    v = np.concatenate([r.v for r in rows])
    going = np.sign(v[np.abs(v) > _SLOW * np.abs(v).max()])
    return {way for way in (1.0, -1.0) if np.sum(going == way) > least * len(going)}


def correlated(estimate: Estimate) -> list[tuple[str, str, float]]:
    """Pairs of parameters whose errors are nearly one and the same.

    Parameters
    ----------
    estimate : Estimate
        As found.

    Returns
    -------
    list[tuple[str, str, float]]
        Two names and the correlation of their errors, beyond 0.98 in size.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        together = estimate.covariance / np.outer(estimate.std, estimate.std)
    names = estimate.names
    return [
        (names[i], names[k], float(together[i, k]))
        for i in range(len(names))
        for k in range(i + 1, len(names))
        if abs(together[i, k]) > _ONE
    ]
