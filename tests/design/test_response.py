"""Measures of a move, on responses whose answer is known by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.control.supervisor import DONE, FAULT, MACRO, MICRO, SETTLING
from macromicro.design.response import PITCH, MoveResult, entry, moves, smoothed, tail
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording

DT = 1e-3
NAN = math.nan


def programme(*steps: tuple[int, float]) -> Programme:
    """Steps of (stage, target in counts or m)."""
    stage, target = zip(*steps, strict=True)
    n = len(stage)
    return Programme(
        "made by hand", np.full(n, NAN), np.array(stage), np.array(target), np.ones(n), NAN, ""
    )


def recording(leave: tuple[str, ...] = (), **given_columns: Any) -> Recording:
    """Columns given by name, all others zero."""
    n = len(given_columns["move"])
    named = {"t": np.arange(n) * DT, **given_columns}
    kept = [c for c in COLUMNS if c.name not in leave]
    return Recording.from_arrays(kept, [named.get(c.name, np.zeros(n)) for c in kept], DT, {})


def one_macro(position: np.ndarray, target: float, last: int = DONE, **more: Any) -> MoveResult:
    phase = np.full(len(position), MACRO)
    phase[-1] = last
    made = recording(
        move=np.zeros(len(position)),
        phase=phase,
        macro_position=position,
        true_carriage=(position + 0.5) * PITCH * 1e3,
        **more,
    )
    return moves(made, programme((0, target)))[0]


def one_micro(laser: np.ndarray, last: int = DONE, **more: Any) -> MoveResult:
    """A micro move to 1 mm."""
    phase = np.full(len(laser), MICRO)
    phase[-1] = last
    made = recording(move=np.zeros(len(laser)), phase=phase, laser=laser, **more)
    return moves(made, programme((1, 1e-3)))[0]


def test_without_a_laser_the_hall_sensor_says_when_a_micro_move_has_arrived() -> None:
    """A lag of 50 ms to 1 mm is within 10 um after ln(100) of them; the laser has no reset."""
    hall = 1.0 - np.exp(-np.arange(1000) * DT / 0.05)
    silent = np.full(1000, NAN)
    resets = np.zeros(1000)
    resets[500] = 1.0
    found = one_micro(silent, hall_position=hall, laser_reset=resets)
    assert found.arrived_s == pytest.approx(0.05 * math.log(100.0), abs=2e-3)
    assert found.final_error is None and found.hall_error == pytest.approx(0.0, abs=0.01)
    assert found.overshoot == pytest.approx(0.0, abs=1e-9)
    phase = np.append(np.full(999, MICRO), DONE)
    none = recording(leave=("laser",), move=np.zeros(1000), phase=phase, hall_position=hall)
    assert moves(none, programme((1, 1e-3)))[0].arrived_s == found.arrived_s
    late = one_micro(silent, hall_position=0.98 * hall)
    assert late.arrived_s is None and late.hall_error == pytest.approx(20.0, abs=0.1)


def test_macro_ramp() -> None:
    """M5's band of 2 counts: 100 counts at one a millisecond arrive after 98 ms."""
    position = np.minimum(np.arange(2000.0), 100.0)
    found = one_macro(position, 100.0)
    assert (found.stage, found.unit, found.complete) == ("macro", "mm", True)
    assert found.target == pytest.approx(100 * PITCH * 1e3)
    assert found.target_counts == 100.0
    assert found.band == pytest.approx(2 * PITCH * 1e3)
    assert found.settling_s == found.arrived_s == pytest.approx(0.098)
    assert found.final_error == found.final_error_counts == found.overshoot == 0.0
    assert found.true_error == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_macro_overshoot_and_final_error(direction: float) -> None:
    """5 counts beyond, then resting 1 count short: signs follow the thesis, target - reading."""
    target = 1000.0 + 100.0 * direction
    position = np.full(3000, target - direction)
    position[:100] = 1000.0
    position[100:200] = target + 5 * direction
    found = one_macro(position, target)
    assert found.overshoot == pytest.approx(5 * PITCH * 1e3)
    assert found.final_error_counts == direction
    assert found.arrived_s == pytest.approx(0.2)


def test_macro_outside_its_band_never_arrived() -> None:
    found = one_macro(np.full(2000, 97.0), 100.0)
    assert found.arrived_s is None and found.settling_s is None
    assert found.final_error_counts == 3.0 and found.complete


def test_macro_passing_through_the_band_at_the_end_has_not_arrived() -> None:
    """Arrival needs the supervisor's dwell of 0.2 s (Figure 6.1)."""
    position = np.full(2000, 0.0)
    position[-100:] = 100.0
    assert one_macro(position, 100.0).arrived_s is None
    position[-250:] = 100.0
    assert one_macro(position, 100.0).arrived_s == pytest.approx(1.75)


def test_macro_is_judged_until_the_next_macro_move() -> None:
    """A carriage that slips under the micro-stage has not stayed within its band."""
    move = np.repeat([0, 1, 2], 1000)
    phase = np.repeat([SETTLING, MICRO, MACRO], 1000)
    phase[-1] = DONE
    position = np.repeat([100.0, 110.0, 200.0], 1000)
    made = recording(move=move, phase=phase, macro_position=position)
    first, _, last = moves(made, programme((0, 100.0), (1, 1e-3), (0, 200.0)))
    assert first.arrived_s is None and first.final_error_counts == -10.0
    assert last.final_error_counts == 0.0 and last.start_s == 2.0


def test_micro_exponential() -> None:
    """1000 um with a time constant of 0.1 s enter 10 um after 0.1 ln(100) s (Section 5.3.2)."""
    t = np.arange(2000) * DT
    laser = 1000.0 * (1.0 - np.exp(-t / 0.1))
    found = one_micro(laser, hall_position=laser * 1e-3, true_micro=laser * 1e-3)
    assert (found.stage, found.unit, found.band) == ("micro", "um", 10.0)
    assert found.settling_s == pytest.approx(0.1 * math.log(100.0), abs=0.003)
    assert found.overshoot == 0.0
    assert found.final_error == pytest.approx(0.0, abs=0.01)


def test_the_laser_tells_what_the_hall_sensor_hides() -> None:
    """Integral action holds the Hall reading on target; the error is the laser's."""
    found = one_micro(
        np.full(2000, 993.0), hall_position=np.full(2000, 1.0), true_micro=np.full(2000, 0.9995)
    )
    assert found.final_error == pytest.approx(7.0)
    assert found.hall_error == pytest.approx(0.0)
    assert found.true_error == pytest.approx(0.5)


def test_noise_of_the_laser_is_no_exit_from_the_band() -> None:
    """2 um of noise (Section 6.4.1) on a bias of 9 um, and one spike."""
    random = np.random.default_rng(1)
    laser = 991.0 + np.clip(random.normal(0.0, 0.7, 2000), -2.0, 2.0)
    laser[1990] -= 8.0
    found = one_micro(laser)
    assert found.arrived_s is not None and found.arrived_s < 0.1
    assert found.overshoot == 0.0


def test_reading_at_the_reset_is_left_out() -> None:
    """The sample of the reset still counts from the reset before: 190 mm away."""
    laser = np.full(2000, 1000.0)
    laser[0] = 190_000.0
    reset = np.zeros(2000)
    reset[0] = 1
    found = one_micro(laser, laser_reset=reset)
    assert found.overshoot == 0.0 and found.settling_s == pytest.approx(0.001)


def test_a_laser_that_falls_silent_is_not_replaced_by_the_hall_sensor() -> None:
    lost = np.where(np.arange(2000) < 1000, 1000.0, NAN)
    found = one_micro(lost, hall_position=np.full(2000, 1.0))
    assert found.final_error is None and found.settling_s is None
    assert found.hall_error == pytest.approx(0.0)


def test_a_real_rig_has_no_truth() -> None:
    made = recording(
        leave=("true_micro", "true_carriage"),
        move=np.repeat([0, 1], 1000),
        phase=np.append(np.full(1999, MICRO), DONE),
    )
    assert [m.true_error for m in moves(made, programme((0, 0.0), (1, 0.0)))] == [None, None]


@pytest.mark.parametrize("last", [MACRO, FAULT])
def test_cut_short(last: int) -> None:
    """By Ctrl-C the phase stays what it was, by the guard it is FAULT."""
    found = one_macro(np.minimum(np.arange(50.0), 100.0), 100.0, last)
    assert not found.complete
    assert found.final_error is None and found.arrived_s is None and found.true_error is None


def test_moves_not_begun_are_not_listed() -> None:
    made = recording(move=np.repeat([-1, 0], 500), phase=np.full(1000, MACRO))
    assert [m.move for m in moves(made, programme((0, 0.0), (1, 1e-3)))] == [0]


def test_no_rows_no_moves() -> None:
    assert moves(recording(move=np.zeros(0)), programme((0, 1.0))) == []


def test_hold_shorter_than_a_second_uses_its_latter_half() -> None:
    assert tail(2000, DT) == 500
    assert tail(400, DT) == 200
    assert tail(1, DT) == 1


series = st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=60).map(np.array)


@settings(max_examples=50)
@given(series, st.floats(0.1, 30.0))
def test_entry_is_the_first_row_that_stays(error: np.ndarray, band: float) -> None:
    row = entry(error, band, DT, 0.0)
    if row is None:
        assert abs(error[-1]) > band
    else:
        assert (np.abs(error[row:]) <= band).all()
        assert row == 0 or abs(error[row - 1]) > band


@settings(max_examples=50)
@given(series)
def test_smoothing_keeps_range_and_straight_lines(y: np.ndarray) -> None:
    mean = smoothed(y, 21)
    assert len(mean) == len(y)
    assert mean.min() >= y.min() - 1e-9 and mean.max() <= y.max() + 1e-9
    ramp = 2.0 * np.arange(len(y)) + y[0]
    assert smoothed(ramp, 21) == pytest.approx(ramp)


def test_only_the_last_move_of_a_run_cut_short_is_incomplete() -> None:
    move = np.repeat([0, 1, 2], 1000)
    phase = np.full(3000, MACRO)
    phase[-1] = FAULT
    made = recording(move=move, phase=phase, macro_position=np.repeat([10.0, 20.0, 30.0], 1000))
    found = moves(made, programme((0, 10.0), (0, 20.0), (0, 30.0)))
    assert [x.complete for x in found] == [True, True, False]
    assert [x.final_error_counts for x in found] == [0.0, 0.0, None]
