"""The compiled survey gives the bits of the interpreted one, whatever the sensors show."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from macromicro.control.live import survey
from macromicro.control.live.parameters import Edges
from macromicro.control.live.survey import NOTHING, Moving, Survey
from macromicro.control.live.surveying import Surveying
from macromicro.types import Sample

from .bench import DT, PITCH


def shown(seed: int, periods: int) -> Iterator[tuple[Sample, Moving]]:
    """A carriage that goes slowly, quickly, rests; sensors that fail, freeze, leap, lose counts."""
    rng = np.random.default_rng(seed)
    x = fine = hall = laser = zero = lost = stood = speed = 0.0
    for k in range(periods):
        if k % 400 == 0:
            speed = float(rng.choice([0.0, 140.0, -140.0, 300.0, -300.0, 1500.0, -3000.0]))
        x += speed * PITCH * DT
        dice = rng.random(6).tolist()
        lost += 3.0 if dice[0] > 0.9995 else 0.0
        zero = x if dice[0] < 0.0005 else zero
        frozen = k % 1000 > 960  # both at a time, and longer than either may
        if not frozen:
            fine = 1e-3 + 0.6e-6 * float(rng.standard_normal())
            laser, hall = x + fine - zero + 0.45e-6 * float(rng.standard_normal()), fine
        stood = 0.0 if speed else stood + DT
        count = float(math.floor(x / PITCH + 0.5)) - lost
        yield (
            Sample(
                k * DT,
                math.nan if dice[1] > 0.998 else count,
                math.nan if dice[2] > 0.998 else hall,
                float(rng.choice([math.nan, math.inf, laser + 1e-3]))
                if dice[3] > 0.9995
                else laser,
                1.0,
                0.0,
            ),
            Moving(fine, speed, stood, 7.0),
        )


@pytest.mark.parametrize(
    ("q", "seed"),
    [
        (Edges(), 0),
        pytest.param(Edges(), 1, marks=pytest.mark.slow),
        (Edges(lag=0.0, needed=3, lost=1.5), 1),
        (Edges(use=0), 0),
    ],
)
def test_the_compiled_survey_gives_the_bits_of_the_survey(seed: int, q: Edges) -> None:
    fast = Surveying(q, PITCH, DT)
    plain = quick = NOTHING
    phases, sure, apart, lapses = 0, 0, 0, 0
    rng = np.random.default_rng(1000 + seed)
    for sample, moving in shown(seed, 20_000):
        before = plain
        plain = survey.look(q, PITCH, plain, sample, moving, DT)
        quick = fast(q, PITCH, quick, sample, moving, DT)
        assert repr(quick) == repr(plain)  # NaN equals NaN
        phases += plain.phase is not None
        sure += math.isfinite(plain.half)
        apart += plain.apart > 0.0
        lapses += before.phase is not None and plain.phase is None
        if rng.random() < 0.002:  # what the machine does to a survey between two samples
            plain, quick = (changed(v, q, k) for v, k in ((plain, seed), (quick, seed)))
    if q.use == 1:
        assert phases > 10_000 and sure > 100 and apart and lapses
    else:
        assert phases == 0


def changed(v: Survey, q: Edges, k: int) -> Survey:
    """Reset, home, begin anew."""
    return (survey.reset_given(v), survey.again(v, PITCH), survey.rebase(q, v, 3.0), NOTHING)[k % 4]


def test_other_parameters_begin_another_survey() -> None:
    fast = Surveying(Edges(), PITCH, DT)
    q, v = Edges(use=0), NOTHING
    for sample, moving in shown(0, 50):
        v = fast(q, PITCH, v, sample, moving, DT)
        assert repr(v) == repr(NOTHING)
