"""A machine of arithmetic in place of the bench, so that what a study says can be known."""

from __future__ import annotations

import math

import pytest

from macromicro.batch.programme_metrics import NAMES
from macromicro.machines import setups
from macromicro.robustness import study, subject
from macromicro.robustness.study import Request, Study
from macromicro.robustness.subject import Subject
from macromicro.settings import Settings

TWO_STAGE = subject.of(setups.two_stage(Settings(), "fast"), 2)


def run(tree: Settings, seed: int) -> list[float]:
    """Settling follows kinetic friction; above 125 % of it the guard stops, above 115 % the
    carriage never settles; the micro error is 2 um and 1 um for each K above 28 degC; the
    vibration is the seed."""
    share = tree.bench.friction.coulomb / Settings().bench.friction.coulomb
    warm = max(tree.bench.thermal.ambient - 28.0, 0.0)
    row = dict.fromkeys(NAMES, 0.0)
    row |= {"macro_settling": 0.6 * share, "contraction": 0.5, "extension": 0.9}
    row |= {"micro_error": 2.0 + warm, "vibration": float(seed)}
    if share > 1.15:
        row |= {"macro_settling": math.inf, "macro_missed": 1.0}
    if share > 1.25:
        row |= dict.fromkeys(NAMES, math.nan)
        row |= {"fault": 1.0, "macro_missed": 8.0, "micro_missed": 32.0, "fault_code": 2.0}
    return [row[name] for name in NAMES]


@pytest.fixture
def request_() -> Request:
    return Request(Settings(), TWO_STAGE.required, 40, 7)


@pytest.fixture
def machine() -> Subject:
    return TWO_STAGE._replace(run=run)


@pytest.fixture
def done(request_: Request, machine: Subject) -> Study:
    return study.run(request_, machine)
