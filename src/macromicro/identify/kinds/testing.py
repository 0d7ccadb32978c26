"""Validation records of a drive; `_report` has what all kinds share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from macromicro.arrays import Array
from macromicro.identify._report import Pair as Trial
from macromicro.identify._report import free_run, pairs, unseen
from macromicro.identify._report import validation_data as data
from macromicro.identify._report import validation_lines as lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.presliding_fit import PreslidingFit
    from macromicro.identify.runs import Run

__all__ = ["Trial", "data", "drawn", "driven", "lines", "unseen"]


def driven(fit: DriveFit | PreslidingFit, run: Run, file: str) -> Trial:
    """A free simulation of an axis over a validation record, from its measured start."""
    from macromicro.identify.axis_fit import start

    x, v = start(run, fit.gain, fit.delay)
    return Trial(file, run.t, run.x, fit.simulate(run.u, run.dt, x, v))


def drawn(
    t: Sequence[Array],
    measured: Sequence[Array],
    model: Sequence[Array],
    trials: Sequence[Trial],
    label: str,
) -> Figure:
    return free_run(pairs(t, measured, model), trials, label)
