"""Recordings and models of the micro-stage, made once: they take seconds."""

import pytest

from macromicro.thesis.chapter5 import actuator_models, electrothermal_runs, kiln_claims
from macromicro.thesis.chapter5 import kiln_runs as kiln
from macromicro.thesis.chapter5.actuator_models import Models
from macromicro.thesis.chapter5.electrothermal_runs import StepData
from macromicro.thesis.chapter5.kiln_claims import KilnRuns
from macromicro.thesis.chapter5.kiln_runs import KilnData


@pytest.fixture(scope="session")
def heated() -> KilnData:
    return kiln.collect()


@pytest.fixture(scope="session")
def stepped() -> StepData:
    return electrothermal_runs.collect(trials=2, volts=(1.5, 1.6, 1.8), cooled=(1.575,))


@pytest.fixture(scope="session")
def kiln_runs(heated: KilnData) -> KilnRuns:
    return kiln_claims.identified(heated)


@pytest.fixture(scope="session")
def models(kiln_runs: KilnRuns) -> Models:
    return actuator_models.measured(kiln_runs.table)
