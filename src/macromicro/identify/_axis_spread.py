"""Covariance of output error, from disturbances of force and position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import _counts, _slow_levels
from macromicro.identify._axis_noise import Noise
from macromicro.identify._axis_pieces import Pieces, cleared, runs, settled
from macromicro.identify._slow_levels import Level
from macromicro.identify._spread import clustered
from macromicro.identify.coverage import Drawn, normal
from macromicro.identify.notices import DataWarning, notice

MANY = 16  # pieces: from there on their own scatter tells the errors
_DRAWS = 100
_BEFORE = 200  # samples for the noise to settle
_SLOW, _FEWEST = 10, 20  # blocks in a slow mean, such means
_PULSE = 0.04  # of the slow force: the answer of an axis that turns is no straight line
_SURE = 2.0  # standard deviations
_WHITE = 1.5  # times the variance of the positions' white noise: there is no other
_OFTEN = 0.95  # of the drawn free runs are as near as this
_DOUBTED = 2.0  # times that: the model is another than the axis


class Spread(NamedTuple):
    covariance: Array  # in the parameters' own scale
    # whether noise explains what the free run misses; else the model is another than the axis
    explained: bool
    # where rounding of the positions to counts explains it, or a force repeats along the way:
    # errors that these make
    draws: Array | None = None
    sensed: bool = False  # position noise, rounding or white, is the only one


def covariance(
    pieces: list[Pieces],
    axis: Any,
    jacobian: Array,
    error: Array,
    told: Noise,
) -> Spread:
    """Covariance of the parameters, and whether noise explains the error of the free simulation."""
    # Many pieces: scatter of the pieces' scores (Liang and Zeger 1986), neighbours combined. Few:
    # noise of force and position is drawn and the change of the free simulation mapped to the
    # parameters, or rounding alone if that is all that is left. An unexplained larger error is
    # reported and widens errors from few pieces.
    rounded = _by_rounding(pieces, axis, jacobian, error)
    if rounded is not None:
        return Spread(rounded.covariance, True, rounded.draws, sensed=True)
    few = sum(len(p.starts) for p in pieces) < MANY
    drawn = _drawn(pieces, axis, jacobian, told, _DRAWS if few else _DRAWS // 4)
    explained = float(np.quantile(np.sqrt(drawn.left), _OFTEN))
    rms = float(np.sqrt(np.mean(error**2)))
    # Residuals of inverse dynamics hold more than disturbing forces. A free run whose slow errors
    # are smaller than these would make them shows how much less there is.
    share, slow = 1.0, _slow(error, told.block)
    least = float(np.quantile(drawn.forced_slow + drawn.noisy_slow, 1.0 - _OFTEN))
    if drawn.forced_slow.any() and slow < least:
        own = drawn.noisy_slow.mean() + _SURE * drawn.noisy_slow.std()
        share = float(max(slow - own, 0.0) / drawn.forced_slow.mean())
    sensed = share == 0.0 and rms**2 <= _WHITE * told.sensor**2
    wide = rms / explained if explained > 0.0 else 1.0
    fits = wide <= _DOUBTED
    if not fits:
        notice(
            DataWarning,
            f"the error of the free simulation is {rms:.3g} RMS where noise explains "
            f"{explained:.2g}: the axis differs from the model (friction that depends on the "
            "position or sticks, a spring, another force); standard errors are widened, and "
            "the parameters absorb the difference",
        )
    if few:
        forced = share * np.cov(drawn.forced.T)
        if fits and told.slow and share > 0.0:
            # What a slow force may be knows that a record shows it weaker than others do, but not
            # that noise of the position is all that the free run shows.
            forced = _by_slow(pieces, axis, jacobian, told.slow)
        size = 1.0 if fits else wide
        found = np.atleast_2d(forced + np.cov(drawn.noisy.T)) * size**2
        if told.repeats is None:
            return Spread(found, fits, sensed=sensed)
        random = np.random.Generator(np.random.PCG64(1))
        others = normal(np.atleast_2d(forced), len(drawn.noisy), random)
        return Spread(found, fits, (others + drawn.noisy) * size)
    ends = np.cumsum([0] + [len(p.rows.v) for p in pieces[:-1]])
    starts = [p.starts + end for p, end in zip(pieces, ends, strict=True)]
    spread = clustered(jacobian, error, np.concatenate(starts))
    return Spread(spread, fits, sensed=sensed and told.repeats is None)


def _by_slow(pieces: list[Pieces], axis: Any, jacobian: Array, may: Sequence[Level]) -> Array:
    """Covariance under a slow force, from the response to its pulses."""
    lengths = [len(p.rows.v) for p in pieces]
    block = max(sum(lengths) // _slow_levels.BLOCKS, 1)
    size = _PULSE * float(np.sqrt(sum(one.weight * one.slow for one in may)))
    pseudo, ends = np.linalg.pinv(jacobian), np.cumsum([0, *lengths])
    asked, parts = [], []
    for k, one in enumerate(pieces):
        still = settled(one, axis)
        plain = runs(one, axis, still.speeds, still.at)
        mine = pseudo[:, ends[k] : ends[k + 1]]
        starts = range(0, lengths[k], block)
        for at in starts:
            force = one.rows.force.copy()
            force[at : at + block] += size
            pushed = one._replace(rows=one.rows._replace(force=force))
            moved = runs(pushed, axis, still.speeds, still.at) - plain
            asked.append(mine @ cleared(one, still, moved) / size)
        parts.append(len(starts))
    per = [Level(m.weight, m.time / block, m.slow, m.white / block) for m in may]
    return _slow_levels.covariance(np.array(asked).T, parts, per)


def _by_rounding(pieces: list[Pieces], axis: Any, jacobian: Array, error: Array) -> Drawn | None:
    """Errors where rounding of the positions is the only residual; otherwise None."""
    parts = np.split(error, np.cumsum([len(p.rows.v) for p in pieces])[:-1])
    steps = _counts.steps([p.rows.run.x for p in pieces], parts)
    if steps is None or not all(p.free for p in pieces):
        return None
    quiet = [settled(p, axis) for p in pieces]
    pseudo, asked = np.linalg.pinv(jacobian), []
    for zeros in _counts.places(len(pieces), _DRAWS):
        off = [
            cleared(one, still, _counts.off(one.rows.run.x - missed, step, at))
            for one, still, missed, step, at in zip(pieces, quiet, parts, steps, zeros, strict=True)
        ]
        asked.append(pseudo @ np.concatenate(off))
    draws = np.array(asked)
    told = np.atleast_2d(np.cov(draws.T))
    outputs = [p.rows.run.x for p in pieces]
    clean = [x - missed for x, missed in zip(outputs, parts, strict=True)]
    every = Drawn(told, draws)
    return every if _counts.alone(jacobian, told, outputs, clean, steps) else None


def _slow(error: Array, block: int) -> float:
    """Mean square of the means over ten blocks of forces."""
    many = max(min(_SLOW * block, len(error) // _FEWEST), 1)
    return float(np.mean(error[: len(error) // many * many].reshape(-1, many).mean(axis=1) ** 2))


class _Drawn(NamedTuple):
    """Effects of drawn noise, a row or value per draw."""

    forced: Array
    noisy: Array
    left: Array
    forced_slow: Array
    noisy_slow: Array


def _drawn(pieces: list[Pieces], axis: Any, jacobian: Array, told: Noise, draws: int) -> _Drawn:
    from scipy.signal import lfilter

    random = np.random.Generator(np.random.PCG64(0))
    pseudo = np.linalg.pinv(jacobian)
    quiet = [settled(p, axis) for p in pieces]
    plain = [runs(p, axis, q.speeds, q.at) for p, q in zip(pieces, quiet, strict=True)]
    made = _Drawn(*(np.empty((draws, jacobian.shape[1])) for _ in range(2)), *np.empty((3, draws)))
    for k in range(draws):
        forces, noises = [], []
        phase = 2.0 * np.pi * k / draws  # of a force that repeats: evenly through a period
        for one, still, run in zip(pieces, quiet, plain, strict=True):
            n = len(run)
            white = random.standard_normal(n // told.block + _BEFORE + 1) * np.sqrt(told.power)
            coarse = lfilter([1.0], np.concatenate([[1.0], told.filter]), white)[_BEFORE:]
            force = one.rows.force + np.repeat(coarse, told.block)[:n]
            shaken = one._replace(rows=one.rows._replace(force=force))
            moved = runs(shaken, axis, still.speeds, still.at)
            forces.append(cleared(one, still, moved - run))
            noise = told.sensor * random.standard_normal(n)
            if told.repeats is not None:
                push = one.rows.force + told.repeats.at(one.rows.run.x, phase)
                pushed = one._replace(rows=one.rows._replace(force=push))
                noise += runs(pushed, axis, still.speeds, still.at) - run
            noises.append(cleared(one, still, noise))
        forced, noisy = np.concatenate(forces), np.concatenate(noises)
        made.forced[k], made.noisy[k] = pseudo @ forced, pseudo @ noisy
        forced -= jacobian @ made.forced[k]
        noisy -= jacobian @ made.noisy[k]
        made.left[k] = np.mean((forced + noisy) ** 2)
        made.forced_slow[k] = _slow(forced, told.block)
        made.noisy_slow[k] = _slow(noisy, told.block)
    return made
