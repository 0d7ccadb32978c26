"""The common job by the package itself."""

from __future__ import annotations

import numpy as np
from job import Job

from macromicro.arrays import Array
from macromicro.control import settings
from macromicro.control.macro import MacroLaw
from macromicro.control.pd import PdTuned
from macromicro.control.settings import Control
from macromicro.models.macro import TUNED, Linear, MacroModel, MacroModelState


def parts(job: Job) -> tuple[MacroModel, MacroLaw]:
    """The job as the package's model and law."""
    model = MacroModel(Linear(job.a, job.b, job.dt), TUNED, job.zone, job.a0, job.delta, job.rail)
    law = settings.prepare(Control(macro_law="pd-tuned")).macro
    tuned = PdTuned(job.now, job.before)
    return model, law.with_gains(tuned)._replace(dead_zone=job.width, limit=job.limit)


def arguments(job: Job) -> tuple[MacroModel, MacroLaw, MacroModelState, Array, bool]:
    """What `models.macro.rollout` takes, but for the array of results."""
    return *parts(job), MacroModelState(0.0, 0.0), np.full(job.samples, job.target), True
