"""Long records of an axis: evenly spread parts, and means over several samples."""

# The mean position over a block responds to the mean force over the span of both blocks, so a free
# simulation is unchanged except within the block of a reversal, and noise is lower.

from __future__ import annotations

import numpy as np

from macromicro.identify.runs import Run
from macromicro.models.mass import Axis

LONG = 400_000  # samples in all records; fewer are taken as they are
_KEPT = 30.0  # samples left in a time constant M/Fv
_PARTS = 4  # stretches that stand for a long record


def is_long(runs: list[Run]) -> bool:
    return sum(len(run.t) for run in runs) > LONG


def stretches(runs: list[Run], count: int = _PARTS, length: int | None = None) -> list[Run]:
    """Evenly spread parts of the records, about so many of that length in all."""
    total = sum(len(run.t) for run in runs)
    made = []
    for run in runs:
        size = min(LONG // count if length is None else length, len(run.t))
        parts = max(min(round(count * len(run.t) / total), len(run.t) // size), 1)
        for first in np.linspace(0, len(run.t) - size, parts).astype(int):
            made.append(Run(*(column[first : first + size] for column in run)))
    return made


def shortened(runs: list[Run], axis: Axis) -> list[Run]:
    """The records as means over blocks that are short for an axis; parts of what is still long."""
    total = sum(len(run.t) for run in runs)
    many = -(-total // LONG)
    if axis.mass > 0.0 and axis.viscous > 0.0:
        step = max(run.dt for run in runs)
        many = min(many, int(axis.mass / axis.viscous / step / _KEPT))
    if many > 1:
        runs = [means(run, many) for run in runs]
    return stretches(runs) if is_long(runs) else runs


def means(run: Run, many: int) -> Run:
    count = len(run.t) // many
    x, u = (column[: count * many].reshape(count, many) for column in (run.x, run.u))
    rising = np.arange(1.0, many + 1.0) / many**2
    force = u @ rising
    force[:-1] += u[1:] @ (1.0 / many - rising)
    force[-1] = u[-1].mean()
    t = run.t[0] + run.dt * (many * np.arange(count) + 0.5 * (many - 1))
    return Run(t, force, x.mean(axis=1))
