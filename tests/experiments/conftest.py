"""Recordings and models of the micro-stage, made once: they take seconds."""

import pytest

from macromicro.experiments import actuator_models, electrothermal, kiln, kiln_claims
from macromicro.experiments.actuator_models import Models
from macromicro.experiments.electrothermal import StepData
from macromicro.experiments.kiln import KilnData
from macromicro.experiments.kiln_claims import KilnRuns


@pytest.fixture(scope="session")
def heated() -> KilnData:
    return kiln.collect()


@pytest.fixture(scope="session")
def stepped() -> StepData:
    return electrothermal.collect(trials=2, volts=(1.5, 1.6, 1.8), cooled=(1.575,))


@pytest.fixture(scope="session")
def kiln_runs(heated: KilnData) -> KilnRuns:
    return kiln_claims.identified(heated)


@pytest.fixture(scope="session")
def models(kiln_runs: KilnRuns) -> Models:
    return actuator_models.measured(kiln_runs.table)
