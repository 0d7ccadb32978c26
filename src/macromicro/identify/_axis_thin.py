"""Long, oversampled records of an axis as means over several samples."""

# The mean position over a block responds to the mean force over the span of both blocks, so a free
# simulation is unchanged except within the block of a reversal, and noise is lower.

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify._axis_choice import divided
from macromicro.identify._triangle import stretches as in_stretches
from macromicro.identify.axis import late, simulate
from macromicro.identify.axis_inverse import Estimate, Rows, corrected, differences, fitted
from macromicro.identify.driven import Driven
from macromicro.identify.notices import DataWarning
from macromicro.identify.records import flag_saturation
from macromicro.identify.runs import Run

LONG = 400_000  # samples in all records; fewer are taken as they are
FINE, COARSE = 100.0, 30.0  # samples left in a time constant M/Fv: regression, free run
_PIECE = 100_000  # samples of a long record whose table is made at a time
_STRETCHES, _STRETCH = 8, 20_000  # parts of records, and samples in each, that tell it roughly
_PARTS = 4  # stretches that stand for a long record
CORNER, FACTOR = 0.08, 10  # of the low-pass, in samples' rate, and of the decimation
_WIDEST = 0.4  # the same corner of means


def factors(runs: list[Run], driven: Driven) -> tuple[int, int]:
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
    total = sum(len(run.t) for run in runs)
    made = []
    for run in runs:
        size = min(length, len(run.t))
        parts = max(min(round(count * len(run.t) / total), len(run.t) // size), 1)
        for first in np.linspace(0, len(run.t) - size, parts).astype(int):
            made.append(Run(*(column[first : first + size] for column in run)))
    return made


def pieces(rows: list[Rows]) -> list[Rows]:
    """Records of more than `LONG` samples in parts of up to 100 000, which saves memory."""
    made = []
    for record in rows:
        n = len(record.v)
        made += divided(record, -(-n // _PIECE) if n > LONG else 1)
    return made


def filtering(many: int, dt: float) -> tuple[float, int]:
    """Low-pass and decimation of means, as near as possible to those of the samples."""
    return min(CORNER * many, _WIDEST) / dt, max(FACTOR // many, 1)


def means(run: Run, many: int) -> Run:
    count = len(run.t) // many
    x, u = (column[: count * many].reshape(count, many) for column in (run.x, run.u))
    rising = np.arange(1.0, many + 1.0) / many**2
    force = u @ rising
    force[:-1] += u[1:] @ (1.0 / many - rising)
    force[-1] = u[-1].mean()
    t = run.t[0] + run.dt * (many * np.arange(count) + 0.5 * (many - 1))
    return Run(t, force, x.mean(axis=1))


def thinned(runs: list[Run], many: int, driven: Driven) -> list[Run]:
    """Records as means over blocks, their inputs delayed and limited as by the drive."""
    made = []
    for k, run in enumerate(runs):
        u, limit = run.u, driven.limit
        u = u if limit is None else flag_saturation(u, f"record[{k}].u", limit)
        made.append(means(run._replace(u=late(u, driven.delay)), many))
    return made


def unblurred(
    runs: list[Run], found: Estimate, driven: Driven, again: Callable[[list[Run]], Estimate]
) -> Estimate:
    """An estimate by means less their bias at reversals, from simulations of the result."""
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
    """Free simulations over the records as sampled, with the estimate by means."""
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
