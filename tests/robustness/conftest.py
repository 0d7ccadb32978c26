"""A machine of arithmetic in place of the bench, so that what a study says can be known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from macromicro.batch import SEED, Trajectories, Variants
from macromicro.batch.programme_metrics import METRICS, NAMES
from macromicro.robustness import job, study
from macromicro.robustness.job import REQUIRED
from macromicro.robustness.study import Request, Study
from macromicro.settings import Settings


class Machine:
    """Settling follows kinetic friction; above 125 % of it the guard stops, above 115 % the
    carriage never settles; the micro error is 2 um and 1 um for each K above 28 degC; the
    vibration is the seed."""

    name, metrics, block = "fake", METRICS, 1

    def base(self) -> Settings:
        return Settings()

    def evaluate(self, variants: Variants, first: int = 0) -> NDArray[np.float64]:
        rows = [self._row(dict(zip(variants.paths, v, strict=True))) for v in variants.values]
        return np.array(rows).reshape(-1, len(METRICS))

    def _row(self, values: dict[str, float]) -> list[float]:
        share = values["bench.friction.coulomb"] / Settings().bench.friction.coulomb
        warm = max(values["bench.thermal.ambient"] - 28.0, 0.0)
        row = dict.fromkeys(NAMES, 0.0)
        row |= {"macro_settling": 0.6 * share, "contraction": 0.5, "extension": 0.9}
        row |= {"micro_error": 2.0 + warm, "vibration": values[SEED]}
        if share > 1.15:
            row |= {"macro_settling": math.inf, "macro_missed": 1.0}
        if share > 1.25:
            row |= dict.fromkeys(NAMES, math.nan)
            row |= {"fault": 1.0, "macro_missed": 8.0, "micro_missed": 32.0, "fault_code": 2.0}
        return [row[name] for name in NAMES]

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        raise NotImplementedError


@pytest.fixture
def request_() -> Request:
    return Request(Settings(), REQUIRED, 40, 7)


@pytest.fixture
def machine() -> Any:
    return Machine()


@pytest.fixture
def done(request_: Request, machine: Machine) -> Study:
    return study.run(request_, job.subject(machine, 2))
