"""Long records of an axis, sampled far faster than it answers, as means over several samples.

The mean of the position over a block moves, from block to block, as the mean of the force over
the span of both tells, so that nothing is lost that the axis answers to: a free run is the same
but for what friction does within the block in which the motion turns. Noise becomes less by the
mean.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.axis import late, simulate
from macromicro.identify.axis_choice import divided
from macromicro.identify.axis_inverse import Estimate, Rows, corrected, differences, fitted
from macromicro.identify.driven import Driven
from macromicro.identify.notices import DataWarning
from macromicro.identify.records import flag_saturation
from macromicro.identify.runs import Run
from macromicro.identify.triangle import stretches as in_stretches

LONG = 400_000  # samples in all records; fewer are taken as they are
FINE, COARSE = 100.0, 30.0  # samples left in a time constant M/Fv: regression, free run
_PIECE = 100_000  # samples of a long record whose table is made at a time
_STRETCHES, _STRETCH = 8, 20_000  # parts of records, and samples in each, that tell it roughly
_PARTS = 4  # stretches that stand for a long record
CORNER, FACTOR = 0.08, 10  # of the low-pass, in samples' rate, and of the decimation
_WIDEST = 0.4  # the same corner of means


def factors(runs: list[Run], driven: Driven) -> tuple[int, int]:
    """Over how many samples means are taken: for regression, and for free runs.

    Parameters
    ----------
    runs : list[Run]
        The records.
    driven : Driven
        What the drive makes of their input.

    Returns
    -------
    fine : int
        1 for records that are short, or hardly sampled faster than the axis answers.
    coarse : int
        Likewise, for free runs, which lose less.
    """
    total = sum(len(run.t) for run in runs)
    if total <= LONG:
        return 1, 1
    rows = []
    for run in stretches(runs, _STRETCHES, _STRETCH):
        if np.ptp(run.x) > 0.0:
            push, corner = driven.force(run.u), CORNER / run.dt
            rows.append(differences(run, push, corner, FACTOR, eccentric=driven.eccentric))
    try:
        axis = fitted(rows, "coulomb", told=False).axis
    except (InputError, ValueError):  # what is wrong with it, the fit to all of it says
        return 1, 1
    if not (axis.mass > 0.0 and axis.viscous > 0.0):
        return 1, 1
    within, most = axis.mass / axis.viscous / runs[0].dt, -(-total // LONG)
    fine, coarse = (max(int(min(within / least, most)), 1) for least in (FINE, COARSE))
    return fine, coarse


def stretches(runs: list[Run], count: int = _PARTS, length: int = LONG // _PARTS) -> list[Run]:
    """Parts of records, evenly spread over all of them.

    Parameters
    ----------
    runs : list[Run]
        The records.
    count : int, optional
        How many parts, about.
    length : int, optional
        Samples in each, at most.

    Returns
    -------
    list[Run]
        One or more of each record.
    """
    total = sum(len(run.t) for run in runs)
    made = []
    for run in runs:
        size = min(length, len(run.t))
        parts = max(min(round(count * len(run.t) / total), len(run.t) // size), 1)
        for first in np.linspace(0, len(run.t) - size, parts).astype(int):
            made.append(Run(*(column[first : first + size] for column in run)))
    return made


def pieces(rows: list[Rows]) -> list[Rows]:
    """Records of more than `LONG` samples as several of no more than 100 000.

    Tables of them are made one after the other, so that less is in memory at a time; a free run
    begins anew in each, which piles up less.

    Parameters
    ----------
    rows : list[Rows]
        The records.

    Returns
    -------
    list[Rows]
        Views, all samples in their order.
    """
    made = []
    for record in rows:
        n = len(record.v)
        made += divided(record, -(-n // _PIECE) if n > LONG else 1)
    return made


def filtering(many: int, dt: float) -> tuple[float, int]:
    """Low-pass and decimation of means, as near as they allow to those of what was measured.

    Parameters
    ----------
    many : int
        Samples in a block.
    dt : float
        From block to block, s.

    Returns
    -------
    cutoff : float
        Hz.
    decimate : int
        Every how many blocks remain.
    """
    return min(CORNER * many, _WIDEST) / dt, max(FACTOR // many, 1)


def means(run: Run, many: int) -> Run:
    """A record as means over blocks of samples.

    Parameters
    ----------
    run : Run
        Its input held from each sample to the next.
    many : int
        Samples in a block.

    Returns
    -------
    Run
        Position and time in the mean of each block; input in its mean on the way to the next.
    """
    count = len(run.t) // many
    x, u = (column[: count * many].reshape(count, many) for column in (run.x, run.u))
    rising = np.arange(1.0, many + 1.0) / many**2
    force = u @ rising
    force[:-1] += u[1:] @ (1.0 / many - rising)
    force[-1] = u[-1].mean()
    t = run.t[0] + run.dt * (many * np.arange(count) + 0.5 * (many - 1))
    return Run(t, force, x.mean(axis=1))


def thinned(runs: list[Run], many: int, driven: Driven) -> list[Run]:
    """Records as means over blocks of samples, their inputs as they acted.

    Parameters
    ----------
    runs : list[Run]
        The records.
    many : int
        Samples in a block.
    driven : Driven
        The input is clipped to its limit, with a warning, and acts late.

    Returns
    -------
    list[Run]
        One for each.
    """
    made = []
    for k, run in enumerate(runs):
        u, limit = run.u, driven.limit
        u = u if limit is None else flag_saturation(u, f"record[{k}].u", limit)
        made.append(means(run._replace(u=late(u, driven.delay)), many))
    return made


def unblurred(
    runs: list[Run], found: Estimate, driven: Driven, again: Callable[[list[Run]], Estimate]
) -> Estimate:
    """An estimate by means less what they make of a reversal, where friction changes its sign.

    Parts of the records are run freely by the axis that was found, sample by sample; what the same
    means make of these is off by as much as it is of the record.

    Parameters
    ----------
    runs : list[Run]
        The records, as they were measured.
    found : Estimate
        By inverse dynamics, from means of them.
    driven : Driven
        What the drive makes of its input.
    again : Callable[[list[Run]], Estimate]
        An estimate in the same way.

    Returns
    -------
    Estimate
        As it was where the parts do not tell the parameters.
    """
    made = []
    for run in stretches(runs):
        free = simulate(found.axis, driven.force(run.u), run.dt, float(run.x[0]))
        made.append(run._replace(x=free))
    try:
        with warnings.catch_warnings():  # of the records they were said already
            warnings.simplefilter("ignore", DataWarning)
            own = again(made)
    except InputError:
        return found
    return corrected(found, own.values)


def whole(
    runs: list[Run],
    found: Estimate,
    starts: list[tuple[float, float]],
    driven: Driven,
    many: int,
) -> tuple[Estimate, list[Array], list[Array]]:
    """Free runs over records as they were measured, of what means of them told.

    Parameters
    ----------
    runs : list[Run]
        The records.
    found : Estimate
        By output error.
    starts : list[tuple[float, float]]
        Position and speed at the start of each record's means.
    driven : Driven
        What the drive makes of its input.
    many : int
        Samples in a block: the level of a free run is that of the first one.

    Returns
    -------
    found : Estimate
        With the error of these free runs.
    free : list[Array]
        Positions, shape (n,) per record.
    errors : list[Array]
        Measured less free run, shape (n,) per record.
    """
    free, errors, extent = [], [], 0.0
    for run, (x, v) in zip(runs, starts, strict=True):
        # In parts and in place, for these are the longest arrays of all.
        mean = run.x.mean()
        extent += sum(float((near - mean) @ (near - mean)) for near in in_stretches(run.x))
        made = simulate(found.axis, driven.force(run.u), run.dt, x, v)
        made += float(np.mean(run.x[:many] - made[:many]))
        free.append(made)
        errors.append(run.x - made)
    square = sum(float(e @ e) for e in errors)
    rms = float(np.sqrt(square / sum(map(len, errors))))
    return replace(found, rms=rms, percent=100.0 * float(np.sqrt(square / extent))), free, errors
