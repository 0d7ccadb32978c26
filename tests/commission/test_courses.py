"""Courses of effort: where they go, how fast, and that a limit ends them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission.courses import Corner, course, decaying, drive, play, quiet
from macromicro.commission.stand import SENSOR, Caution, CommissionError, Record, Stand
from macromicro.place import ANGLE

DT = 1e-3


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=6), st.floats(1.0, 50.0))
def test_a_course_comes_by_every_corner_and_is_never_faster(
    goals: list[float], rate: float
) -> None:
    efforts = course([Corner(u, 0.01, rate) for u in goals], DT)
    assert efforts[0] == 0.0 and efforts[-1] == goals[-1]
    assert np.abs(np.diff(efforts)).max(initial=0.0) <= rate * DT * (1.0 + 1e-9)
    at = 0
    for goal in goals:
        here = np.flatnonzero(efforts[at:] == goal)
        assert len(here) >= 10
        at += int(here[0])


def test_a_step_takes_one_period() -> None:
    efforts = course([Corner(2.0, 0.003, math.inf), Corner(0.0, 0.0, math.inf)], DT)
    assert efforts.tolist() == [0.0, 2.0, 2.0, 2.0, 0.0]


def test_a_swing_dies_away_about_its_middle() -> None:
    turns = decaying(1.0, 4.0, 5)
    assert turns[:3] == [5.0, -2.0, 3.25]
    assert all(abs(b - 1.0) < abs(a - 1.0) for a, b in pairwise(turns))


def test_a_course_is_played_as_it_is() -> None:
    rig = Virtual(PLAIN._replace(coulomb=50.0))
    on = Stand(session(rig), rig.dt, rig.pitch)
    efforts = course([Corner(1.0, 0.01, 20.0), Corner(0.0, 0.01, 20.0)], DT)
    record = play(on, efforts, Caution(5.0, 1.0))
    assert record.u[: len(efforts)].tolist() == efforts.tolist()
    assert rig.log[: len(efforts)] == efforts.tolist()


def test_a_limit_ends_a_course() -> None:
    rig = Virtual()
    on = Stand(session(rig), rig.dt, rig.pitch)
    with pytest.raises(CommissionError, match=r"the window at 5 V"):
        play(on, np.full(500, 5.0), Caution(5.0, math.inf, high=1e-3))
    assert rig.effort == 0.0


def test_efforts_stay_above_the_lowest() -> None:
    rig = Virtual(PLAIN._replace(coulomb=50.0))
    on = Stand(session(rig), rig.dt, rig.pitch)
    play(on, np.array([0.0, -5.0, 5.0]), Caution(4.0, math.inf, lowest=-1.0))
    assert rig.log[:3] == [0.0, -1.0, 4.0]


class Passed:
    """A stand on which the first reading is beyond a limit already."""

    place = ANGLE

    def drive(self, *given: object) -> Record:
        return Record(np.zeros(1), np.zeros(1), np.array([math.pi]), "the window")


def test_a_limit_that_was_passed_before_any_effort_is_told_in_the_stages_unit() -> None:
    with pytest.raises(CommissionError, match="passed the window at 0 V, 180 deg"):
        drive(Passed(), lambda *state: 0.0, 1.0, Caution(1.0, 1.0))  # type: ignore[arg-type]


class Silent(Passed):
    """A stand whose sensor stops giving values."""

    def drive(self, *given: object) -> Record:
        return Record(np.zeros(2), np.zeros(2), np.array([0.0, math.nan]), SENSOR)


def test_a_sensor_without_values_is_told_and_is_no_limit() -> None:
    for run in (quiet, lambda stand, caution: drive(stand, lambda *state: 0.0, 1.0, caution)):
        with pytest.raises(CommissionError, match="sensor gives no value"):
            run(Silent(), Caution(1.0, 1.0))  # type: ignore[arg-type]
