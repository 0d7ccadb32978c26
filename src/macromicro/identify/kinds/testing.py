"""Validation records of a rigid or an elastic drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

from macromicro.identify._report import Pair

if TYPE_CHECKING:
    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.presliding_fit import PreslidingFit
    from macromicro.identify.runs import Run


def driven(fit: DriveFit | PreslidingFit, run: Run, file: str) -> Pair:
    # A free simulation from the measured start.
    from macromicro.identify.axis_fit import start

    x, v = start(run, fit.gain, fit.delay)
    return Pair(file, run.t, run.x, fit.simulate(run.u, run.dt, x, v))
