"""Recordings and models of the micro-stage, made once: they take seconds."""

import pytest

from macromicro.thesis.chapter5 import _electrothermal_runs, _kiln_claims, actuator_models
from macromicro.thesis.chapter5 import kiln_runs as kiln
from macromicro.thesis.chapter5._electrothermal_runs import StepData
from macromicro.thesis.chapter5._kiln_claims import KilnRuns
from macromicro.thesis.chapter5.actuator_models import Models
from macromicro.thesis.chapter5.kiln_runs import KilnData


@pytest.fixture(scope="session")
def heated() -> KilnData:
    return kiln.collect()


@pytest.fixture(scope="session")
def stepped() -> StepData:
    return _electrothermal_runs.collect(trials=2, volts=(1.5, 1.6, 1.8), cooled=(1.575,))


@pytest.fixture(scope="session")
def kiln_runs(heated: KilnData) -> KilnRuns:
    return _kiln_claims.identified(heated)


@pytest.fixture(scope="session")
def models(kiln_runs: KilnRuns) -> Models:
    return actuator_models.measured(kiln_runs.table)
