"""Recordings and models of the micro-stage, those of its procedures on the default bench."""

import pytest

from macromicro.thesis.chapter5.actuator_models import Models
from macromicro.thesis.chapter5.electrothermal_runs import StepData
from macromicro.thesis.chapter5.kiln import KilnRuns
from macromicro.thesis.chapter5.kiln_runs import KilnData

from .ended import collected


@pytest.fixture(scope="session")
def heated(kiln_runs: KilnRuns) -> KilnData:
    return kiln_runs.heated


@pytest.fixture(scope="session")
def stepped(models: Models) -> StepData:
    return models.data


@pytest.fixture(scope="session")
def kiln_runs() -> KilnRuns:
    found: KilnRuns = collected("kiln")
    return found


@pytest.fixture(scope="session")
def models() -> Models:
    found: Models = collected("electrothermal")
    return found
