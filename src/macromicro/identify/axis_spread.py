"""How sure output error is of an axis' parameters: from what disturbs force and position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import counts
from macromicro.identify.axis_inverse import Estimate, Rows, force_residuals, regressors
from macromicro.identify.axis_pieces import Pieces, cleared, runs, settled
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.slow_levels import block_means
from macromicro.identify.slow_noise import Fit, is_slow, unshown
from macromicro.identify.spread import autoregression, clustered, larger

MANY = 16  # pieces: from there on their own scatter tells the errors
_DRAWS = 100
_BEFORE = 200  # samples for the noise to settle
_BLOCK = 0.1  # of the time constant: over which forces are averaged
_POINTS = 60  # blocks wanted
_SLOW, _FEWEST = 10, 20  # blocks in a slow mean, such means
_SURE = 2.0  # standard deviations
_OFTEN = 0.95  # of the drawn free runs are as near as this
_DOUBTED = 2.0  # times that: the model is another than the axis


class Noise(NamedTuple):
    """What disturbs records.

    Attributes
    ----------
    block : int
        Samples over which a disturbing force is held.
    filter : ndarray, shape (order,)
        Its autoregression D(z) w = white noise, from block to block.
    power : float
        Variance of that white noise, force squared.
    sensor : float
        Standard deviation of the position's own noise, white.
    unshown : Sequence[ndarray]
        Where the force is as slow as the record: D of each force that it may be; else none.
    """

    block: int
    filter: Array
    power: float
    sensor: float
    unshown: Sequence[Array] = ()


class Spread(NamedTuple):
    """How sure the parameters are.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
        In the parameters' own scale.
    explained : bool
        Whether noise explains what the free run misses; else the model is another than the axis.
    rounded : bool
        Whether rounding of the positions to counts explains it.
    """

    covariance: Array
    explained: bool
    rounded: bool = False


def sensed(x: Array) -> float:
    """Standard deviation of the noise of a position, by its fourth differences.

    Motion of a mass has next to none, of white noise their variance is 70 times its own.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions.

    Returns
    -------
    float
        Unit of x.
    """
    return float(np.sqrt(np.mean(np.diff(x, 4) ** 2) / 70.0))


def disturbance(rows: list[Rows], start: Estimate) -> Noise:
    """The noise that the residuals of inverse dynamics with rigid friction show.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    start : Estimate
        By inverse dynamics.

    Returns
    -------
    Noise
        Of all records.
    """
    return noise(rows, start.axis, force_residuals(rows, start), regressors(rows, start))


def noise(rows: list[Rows], axis: Any, disturbed: list[Array], taken: list[Array]) -> Noise:
    """The noise of force and position that the residuals of inverse dynamics show.

    A free run answers to slow forces alone, so residuals are averaged over blocks. There noise of
    the position, which inverse dynamics differentiates twice, has next to no part, and its part is
    taken off. A force as slow as the record is slower than residuals show it (`slow_noise`).

    Parameters
    ----------
    rows : list[Rows]
        The records.
    axis : Any
        With `mass` and `viscous`.
    disturbed : list[ndarray]
        Measured less predicted force of each record, decimated, shape (m,).
    taken : list[ndarray]
        What each parameter adds to that force, shape (m, p).

    Returns
    -------
    Noise
        Of all records.
    """
    dt, factor = rows[0].run.dt, rows[0].factor
    total = sum(len(d) for d in disturbed)
    constant = axis.mass / axis.viscous if axis.mass > 0.0 and axis.viscous > 0.0 else 0.0
    many = min(round(_BLOCK * constant / (factor * dt)), total // _POINTS)
    many = max(many, 1)
    sensor = float(np.sqrt(np.mean([sensed(r.run.x) ** 2 for r in rows])))
    means = [block_means(d, many) for d in disturbed if len(d) >= many]
    shown = autoregression(means)
    slower: list[Array] = []
    if is_slow(sum(map(len, means)), shown):
        table = np.concatenate([block_means(t, many) for t in taken if len(t) >= many])
        fit = Fit([len(m) for m in means], np.linalg.pinv(table), table)
        slower = [d for d, _ in unshown(fit, shown, autoregression, np.random.default_rng(0))]
    d, power = shown
    block = many * factor
    seen = float(np.mean(np.concatenate(means) ** 2))
    own = (axis.mass * sensor / dt**2) ** 2 * _differentiated(block, factor)
    left = max(1.0 - own / seen, 0.0) if seen > 0.0 else 0.0
    return Noise(block, d, power * left, sensor, slower)


def _differentiated(block: int, factor: int) -> float:
    """Variance of the block mean of white noise's second difference behind the low-pass."""
    f = np.linspace(0.0, min(0.08, 0.4 / factor), 501)[1:]
    one = np.sin(np.pi * f)
    mean = np.sin(np.pi * f * block) / (block * one)
    return float(2.0 * np.sum((2.0 * one) ** 4 * mean**2) * (f[1] - f[0]))


def covariance(
    pieces: list[Pieces],
    axis: Any,
    jacobian: Array,
    error: Array,
    told: Sequence[Noise],
) -> Spread:
    """Covariance of the parameters, and whether noise explains what the free run misses.

    Of many pieces: by the scatter of what each asks for (Liang and Zeger 1986), neighbours taken
    together. Of few: noise of force and position is drawn anew and the change of the free run
    mapped to the parameters. Where rounding to counts is all that is left, it is drawn alone. A
    free run that misses by far more than the drawn ones is said, and widens errors from few pieces
    by as much.

    Parameters
    ----------
    pieces : list[Pieces]
        Of all records.
    axis : Any
        As found: a model that `axis_pieces.runs` takes.
    jacobian : ndarray, shape (n, p)
        Slopes of the errors by the parameters, pieces stacked.
    error : ndarray, shape (n,)
        Measured less free run.
    told : Sequence[Noise]
        What disturbs them, or what may: the larger errors are told, and the last one judges whether
        the free run is explained.

    Returns
    -------
    Spread
        How sure the parameters are.
    """
    rounded = _by_rounding(pieces, axis, jacobian, error)
    if rounded is not None:
        return Spread(rounded, True, rounded=True)
    few = sum(len(p.starts) for p in pieces) < MANY
    found, fits = _by_noise(pieces, axis, jacobian, error, told[-1], few)
    for other in told[:-1] if few else ():
        found = larger(found, _by_noise(pieces, axis, jacobian, error, other, few, warned=False)[0])
    return Spread(found, fits)


def _by_noise(
    pieces: list[Pieces],
    axis: Any,
    jacobian: Array,
    error: Array,
    told: Noise,
    few: bool,
    *,
    warned: bool = True,
) -> tuple[Array, bool]:
    """As `covariance`, by one noise; of many pieces by their own scatter."""
    drawn = _drawn(pieces, axis, jacobian, told, _DRAWS if few else _DRAWS // 4)
    explained = float(np.quantile(np.sqrt(drawn.left), _OFTEN))
    rms = float(np.sqrt(np.mean(error**2)))
    # Residuals of inverse dynamics hold more than disturbing forces. A free run whose slow errors
    # are smaller than these would make them shows how much less there is.
    share, slow = 1.0, _slow(error, told.block)
    if slow < float(np.quantile(drawn.forced_slow + drawn.noisy_slow, 1.0 - _OFTEN)):
        own = drawn.noisy_slow.mean() + _SURE * drawn.noisy_slow.std()
        share = float(max(slow - own, 0.0) / drawn.forced_slow.mean())
    wide = rms / explained if explained > 0.0 else 1.0
    fits = wide <= _DOUBTED
    if not fits and warned:
        notice(
            DataWarning,
            f"the free run misses by {rms:.3g} RMS where noise explains {explained:.2g}: the axis "
            "is not what this model says (friction that depends on the place or sticks, a spring, "
            "another force); standard errors are widened, and parameters stand for something else",
        )
    if few:
        if fits and told.unshown:
            drawn = _drawn(pieces, axis, jacobian, told, _DRAWS, told.unshown)
        found = np.atleast_2d(share * np.cov(drawn.forced.T) + np.cov(drawn.noisy.T))
        return (found if fits else found * wide**2), fits
    ends = np.cumsum([0] + [len(p.rows.v) for p in pieces[:-1]])
    starts = [p.starts + end for p, end in zip(pieces, ends, strict=True)]
    return clustered(jacobian, error, np.concatenate(starts)), fits


def _by_rounding(pieces: list[Pieces], axis: Any, jacobian: Array, error: Array) -> Array | None:
    """Covariance where rounding of the positions is all that the free runs leave; else None."""
    parts = np.split(error, np.cumsum([len(p.rows.v) for p in pieces])[:-1])
    steps = counts.steps([p.rows.run.x for p in pieces], parts)
    if steps is None or not all(p.free for p in pieces):
        return None
    random = np.random.Generator(np.random.PCG64(0))
    quiet = [settled(p, axis) for p in pieces]
    pseudo, asked = np.linalg.pinv(jacobian), []
    for _ in range(_DRAWS):
        off = [
            cleared(one, still, counts.noise(one.rows.run.x - missed, 0.0, step, random))
            for one, still, missed, step in zip(pieces, quiet, parts, steps, strict=True)
        ]
        asked.append(pseudo @ np.concatenate(off))
    told = np.atleast_2d(np.cov(np.array(asked).T))
    outputs = [p.rows.run.x for p in pieces]
    clean = [x - missed for x, missed in zip(outputs, parts, strict=True)]
    return told if counts.alone(jacobian, told, outputs, clean, steps) else None


def _slow(error: Array, block: int) -> float:
    """Mean square of the means over a time constant or so, ten blocks of forces."""
    many = max(min(_SLOW * block, len(error) // _FEWEST), 1)
    return float(np.mean(error[: len(error) // many * many].reshape(-1, many).mean(axis=1) ** 2))


class _Drawn(NamedTuple):
    """What drawn noise does, a row or value for each draw: by how much disturbing forces, and noise
    of the position, move the parameters; mean squares of what both leave, and of its slow part from
    each."""

    forced: Array
    noisy: Array
    left: Array
    forced_slow: Array
    noisy_slow: Array


def _drawn(
    pieces: list[Pieces],
    axis: Any,
    jacobian: Array,
    told: Noise,
    draws: int,
    filters: Sequence[Array] = (),
) -> _Drawn:
    """So many draws; by each filter in turn, where some are given, else by that of the noise."""
    from scipy.signal import lfilter

    filters = filters or [told.filter]

    random = np.random.Generator(np.random.PCG64(0))
    pseudo = np.linalg.pinv(jacobian)
    quiet = [settled(p, axis) for p in pieces]
    plain = [runs(p, axis, q.speeds, q.at) for p, q in zip(pieces, quiet, strict=True)]
    made = _Drawn(*(np.empty((draws, jacobian.shape[1])) for _ in range(2)), *np.empty((3, draws)))
    for k in range(draws):
        forces, noises = [], []
        for one, still, run in zip(pieces, quiet, plain, strict=True):
            n = len(run)
            white = random.standard_normal(n // told.block + _BEFORE + 1) * np.sqrt(told.power)
            coarse = lfilter([1.0], np.concatenate([[1.0], filters[k % len(filters)]]), white)[
                _BEFORE:
            ]
            force = one.rows.force + np.repeat(coarse, told.block)[:n]
            shaken = one._replace(rows=one.rows._replace(force=force))
            moved = runs(shaken, axis, still.speeds, still.at)
            forces.append(cleared(one, still, moved - run))
            noises.append(cleared(one, still, told.sensor * random.standard_normal(n)))
        forced, noisy = np.concatenate(forces), np.concatenate(noises)
        made.forced[k], made.noisy[k] = pseudo @ forced, pseudo @ noisy
        forced -= jacobian @ made.forced[k]
        noisy -= jacobian @ made.noisy[k]
        made.left[k] = np.mean((forced + noisy) ** 2)
        made.forced_slow[k] = _slow(forced, told.block)
        made.noisy_slow[k] = _slow(noisy, told.block)
    return made
