"""How a survey is handed to compiled code and comes back, without compiling."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.control.live import edges, survey, surveying
from macromicro.control.live.edges import Phase
from macromicro.control.live.survey import NOTHING, Moving, Survey
from macromicro.control.live.surveying import Surveying
from macromicro.types import Sample

from .bench import DT, PITCH
from .surveys import COUNT, FINE, OFFSET, Q, resting

# Every field another number, in the order of the fields.
NUMBERS = [float(k) for k in range(100, 126)]
EACH = Survey(Phase(*NUMBERS[:8]), *NUMBERS[8:])


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surveying, "compiled", lambda function: function)


def test_a_survey_is_stored_field_by_field_and_restored() -> None:
    row = np.full(len(NUMBERS), math.nan)
    surveying._store(EACH, row)
    assert row.tolist() == NUMBERS
    assert surveying._restored(row) == EACH


def asked_of(v: Survey) -> tuple[Sample, Moving]:
    """A sample with another number in every place, and its survey `v`."""
    return (
        Sample(0.0, COUNT, 0.7, v.laser + 1e-6, 1.0, 0.0),
        Moving(FINE + 1e-6, 30.0, 0.05, OFFSET),
    )


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("v", [resting(), resting(awaited=5.0, apart=0.2), NOTHING])
def test_it_tells_what_the_survey_tells(v: Survey) -> None:
    fast = Surveying(Q, PITCH, DT)
    expected = v
    for k in range(4):  # the first is taken over, the others are its own
        sample, moving = asked_of(resting())
        sample = sample._replace(encoder=COUNT + k, laser=sample.laser + k * PITCH)
        expected = survey.look(Q, PITCH, expected, sample, moving, DT)
        v = fast(Q, PITCH, v, sample, moving, DT)
        assert repr(v) == repr(expected)
    assert v.phase is not None


@pytest.mark.usefixtures("plain")
def test_what_is_changed_between_two_samples_is_taken_over() -> None:
    fast = Surveying(Q, PITCH, DT)
    sample, moving = asked_of(resting())
    v = fast(Q, PITCH, resting(), sample, moving, DT)
    sample = sample._replace(laser=sample.laser + 1e-6)
    other = v._replace(base=v.base + 1e-6, gap=0.2)
    assert repr(fast(Q, PITCH, other, sample, moving, DT)) == repr(
        survey.look(Q, PITCH, other, sample, moving, DT)
    )
    sample = sample._replace(laser=sample.laser + 1e-6)
    assert repr(fast(Q, PITCH, NOTHING, sample, moving, DT)) == repr(
        survey.look(Q, PITCH, NOTHING, sample, moving, DT)
    )


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("number", [0.0, 1.0])
def test_a_phase_without_an_edge_is_one(number: float) -> None:
    begun = edges.begin(COUNT, 0.2 * PITCH, PITCH, Q.scale)._replace(number=number)
    sample, moving = asked_of(resting())
    v = Surveying(Q, PITCH, DT)(Q, PITCH, resting(phase=begun), sample, moving, DT)
    assert v.phase is not None and v.phase.number == number
    away = Surveying(Q, PITCH, DT)(
        Q, PITCH, resting(), sample._replace(laser=math.nan), moving, DT
    )  # fmt: skip
    assert repr(away) == repr(NOTHING)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("q", "pitch", "dt"), [(Q._replace(use=0), PITCH, DT), (Q, 2e-4, DT), (Q, PITCH, 2e-3)]
)
def test_other_parameters_begin_another_survey(q: survey.Edges, pitch: float, dt: float) -> None:
    fast = Surveying(Q, PITCH, DT)
    sample, moving = asked_of(resting())
    v = fast(Q, PITCH, resting(), sample, moving, DT)
    sample = sample._replace(laser=sample.laser + 1e-6)
    told = fast(q, pitch, v, sample, moving, dt)
    assert repr(told) == repr(survey.look(q, pitch, v, sample, moving, dt))
    sample = sample._replace(laser=sample.laser + 1e-6)
    assert repr(fast(q, pitch, told, sample, moving, dt)) == repr(
        survey.look(q, pitch, told, sample, moving, dt)
    )
