"""Output error for an axis: the parameters whose free run is nearest to the measured one."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.axis import Axis, late, simulate
from macromicro.identify.axis_inverse import Estimate, Rows, force_residuals
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.spread import autoregression

_DRAWS = 60
_BEFORE = 200  # samples for the noise to settle
_FORCES = ("coulomb", "offset", "stribeck")


def begun(rows: Rows) -> tuple[float, float]:
    """Position and speed at the start of a record.

    Parameters
    ----------
    rows : Rows
        The record.

    Returns
    -------
    x : float
        Measured.
    v : float
        Filtered, per second; less than 2 % of the record's greatest counts as rest.
    """
    v = float(rows.v[0])
    moving = abs(v) > 0.02 * float(np.abs(rows.v).max())
    return float(rows.run.x[0]), v if moving else 0.0


def free_runs(rows: list[Rows], axis: Axis) -> tuple[list[Array], list[Array]]:
    """Free runs of an axis from each record's measured start.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    axis : Axis
        Parameters.

    Returns
    -------
    free : list[Array]
        Positions, shape (n,) per record.
    errors : list[Array]
        Measured less free run, shape (n,) per record.
    """
    free, errors = [], []
    for r in rows:
        run = simulate(axis, r.force, r.run.dt, *begun(r))
        free.append(run)
        errors.append(r.run.x - run)
    return free, errors


def refined(rows: list[Rows], start: Estimate, lag: float | None = None) -> Estimate:
    """Output error from an estimate by inverse dynamics; mass and friction stay above zero.

    Gradients are differences over 0.1 % of a parameter, wide enough to smooth over single samples
    at which the axis sticks or not.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    start : Estimate
        Where the search begins; its names are the free parameters.
    lag : float | None, optional
        Where the search for the force's lag begins, s; None: the force acts at once.

    Returns
    -------
    Estimate
        Its `rms` is that of the position.
    """
    from scipy.optimize import least_squares

    names, first = start.names, start.values
    if lag is not None:
        names, first = (*names, "lag"), np.append(first, lag)
    push = max(float(np.abs(r.force).max()) for r in rows)
    scale = np.maximum(np.abs(first), 1e-2 * push * np.array([n in _FORCES for n in names]))
    if "asymmetry" in names:
        at = names.index("asymmetry")
        scale[at] = max(scale[at], 0.1 * scale[names.index("viscous")])
    if lag is not None:
        scale[-1] = rows[0].run.dt
    scale[scale == 0.0] = 1.0
    signed = np.array([n in ("offset", "asymmetry") for n in names])
    low = np.where(signed, -np.inf, 1e-6)
    begin = np.where(signed, first / scale, np.maximum(first / scale, 1e-2))

    def axis(values: Array) -> Axis:
        return Axis(**dict(zip(names, values.tolist(), strict=True)))

    # What is minimised is the distance of a simulation from the record, not of an equation from
    # the data: positions are taken as measured and never differentiated, so their noise does not
    # bias the result. The price is a cost with local minima, and kinks where the axis sticks; that
    # is why the search starts from inverse dynamics and is given wide differences.
    def missed(scaled: Array) -> Array:
        return np.concatenate(free_runs(rows, axis(scaled * scale))[1])

    found = least_squares(
        missed,
        begin,
        bounds=(low, np.inf),
        jac="3-point",
        diff_step=1e-3,
        xtol=1e-7,
        ftol=1e-9,
        max_nfev=100,
    )
    if found.status == 0:
        notice(ConvergenceWarning, "output error: not settled; the last values are returned")
    error, final = found.fun, axis(found.x * scale)
    runs = free_runs(rows, final)[0]
    pushed = [r._replace(force=late(r.force, final.lag / r.run.dt)) for r in rows]
    disturbed = force_residuals(pushed, start)
    spread = _covariance(rows, disturbed, final, runs, found.jac) * np.outer(scale, scale)
    least = ~signed & (found.x <= 2.0 * low)
    if least.any():
        ended = ", ".join(n for n, at in zip(names, least, strict=True) if at)
        notice(
            DataWarning,
            f"output error: {ended} at the least that is allowed, next to 0; the record does not "
            "show how much there is, and no standard error is told for it",
        )
        spread[least, :] = spread[:, least] = np.nan
    about = np.concatenate([r.run.x - r.run.x.mean() for r in rows])
    rms = float(np.sqrt(np.mean(error**2)))
    return Estimate(final, names, spread, rms, 100.0 * rms / float(np.sqrt(np.mean(about**2))))


def _covariance(
    rows: list[Rows], disturbed: list[Array], axis: Axis, free: list[Array], jacobian: Array
) -> Array:
    """Covariance of the parameters from what disturbs the force.

    A free run's errors come from disturbances of the force and pile up like a random walk,
    so their own spectrum says little. In their place: the residual force of inverse
    dynamics, as an autoregression, is drawn anew, added to the force, and the change of the
    free run is mapped to the parameters, `_DRAWS` times.
    """
    from scipy.signal import lfilter

    d, power = autoregression(disturbed)
    random = np.random.Generator(np.random.PCG64(0))
    pseudo = np.linalg.pinv(jacobian)
    moved = np.empty((_DRAWS, jacobian.shape[1]))
    for k in range(_DRAWS):
        changes = []
        for r, run in zip(rows, free, strict=True):
            count = len(run) // r.factor + _BEFORE + 1
            white = random.standard_normal(count) * np.sqrt(power)
            coarse = lfilter([1.0], np.concatenate([[1.0], d]), white)[_BEFORE:]
            shaken = r.force + np.repeat(coarse, r.factor)[: len(run)]
            changes.append(simulate(axis, shaken, r.run.dt, *begun(r)) - run)
        moved[k] = pseudo @ np.concatenate(changes)
    return np.asarray(np.atleast_2d(np.cov(moved.T)))
