"""A machine of arithmetic in place of the bench, so that what a study says can be known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from macromicro.robustness import requirements, study
from macromicro.robustness.job import Job, Task
from macromicro.robustness.metrics import NAMES
from macromicro.robustness.study import Request, Study
from macromicro.settings import Settings


def fake(task: Task) -> NDArray[np.float64]:
    """Settling follows kinetic friction; above 125 % of it the guard stops, above 115 % the
    carriage never settles; the micro error is 2 um and 1 um for each K above 28 degC."""
    share = task.settings.bench.friction.coulomb / Settings().bench.friction.coulomb
    warm = max(task.settings.bench.thermal.ambient - 28.0, 0.0)
    row = dict.fromkeys(NAMES, 0.0)
    row |= {"macro_settling": 0.6 * share, "contraction": 0.5, "extension": 0.9}
    row["micro_error"] = 2.0 + warm
    row["vibration"] = float(task.seed)
    if share > 1.15:
        row |= {"macro_settling": math.inf, "macro_missed": 1.0}
    if share > 1.25:
        row |= dict.fromkeys(NAMES, math.nan)
        row |= {"fault": 1.0, "macro_missed": 8.0, "micro_missed": 32.0, "fault_code": 2.0}
    return np.array([row[name] for name in NAMES])


@pytest.fixture
def request_() -> Request:
    return Request(Settings(), requirements.DEFAULTS, 40, 7, 2)


@pytest.fixture
def machine() -> Job:
    return fake


@pytest.fixture
def done(request_: Request) -> Study:
    return study.run(request_, fake)
