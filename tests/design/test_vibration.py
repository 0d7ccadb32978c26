"""Residual vibration (Section 6.2, Figure 6.3) found again in made-up laser readings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.control.supervisor import DONE, MACRO, MICRO, SETTLING, WAITING
from macromicro.design.response import MoveResult, moves
from macromicro.design.vibration import CREEP, Vibration, decaying_sine, vibration
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording

DT, REST, ROWS = 1e-3, 500, 2700


def shaken(
    amplitude: float, frequency: float, decay: float, extending: float = 0.0, noise: float = 0.5
) -> Vibration | None:
    """What is found after a macro move of 140 counts that stands from row REST on, while
    the micro-stage still extends from `extending` [um]."""
    t = (np.arange(ROWS) - REST) * DT
    random = np.random.default_rng(7)
    swing = amplitude * np.exp(-decay * t) * np.sin(2 * math.pi * frequency * t) * (t >= 0)
    back = extending * np.exp(-np.maximum(t, 0.0) / 0.4)
    arrays = {c.name: np.zeros(ROWS) for c in COLUMNS}
    arrays["t"] = np.arange(ROWS) * DT
    arrays["macro_position"] = np.clip(np.floor(140.0 * (1 + t / (REST * DT))), 0, 140)
    arrays["hall_position"] = back * 1e-3
    arrays["laser"] = 10_000.0 + swing + back + random.normal(0.0, noise, ROWS)
    arrays["phase"] = np.where(t < 0.2, MACRO, SETTLING)
    arrays["phase"][-1] = DONE
    recording = Recording.from_arrays(COLUMNS, [arrays[c.name] for c in COLUMNS], DT, {})
    one = np.array([math.nan]), np.array([0]), np.array([140.0]), np.array([0.0])
    return vibration(recording, moves(recording, Programme("", *one, math.nan, ""))[0])


@settings(max_examples=30, deadline=None)
@given(st.floats(10.0, 40.0), st.floats(8.0, 60.0), st.floats(0.6, 3.0))
def test_finds_what_was_put_in(amplitude: float, frequency: float, decay: float) -> None:
    found = shaken(amplitude, frequency, decay)
    assert found is not None
    assert found.frequency_hz == pytest.approx(frequency, rel=0.01)
    assert found.decay_rate == pytest.approx(decay, abs=0.15)
    assert found.rest_s == pytest.approx(REST * DT, abs=2e-3)
    # The first peak comes within half a period of the end of the creep.
    late = CREEP + 0.5 / frequency
    assert amplitude * math.exp(-decay * late) * 0.93 < found.amplitude_um < amplitude * 1.07
    assert found.decay_s == pytest.approx(math.log(amplitude / 2.0) / decay, rel=0.12)


def test_figures_of_the_thesis() -> None:
    """20 um that decay in two seconds (Section 6.2, I2)."""
    found = shaken(20.0, 18.0, 1.15)
    assert found is not None and found.decay_s is not None
    assert found.amplitude_um == pytest.approx(19.0, abs=1.0)
    assert found.decay_s == pytest.approx(2.0, abs=0.1)


def test_a_stage_that_still_extends_is_not_taken_for_vibration() -> None:
    calm, moving = shaken(20.0, 18.0, 1.15), shaken(20.0, 18.0, 1.15, extending=300.0)
    assert calm is not None and moving is not None
    assert moving.amplitude_um == pytest.approx(calm.amplitude_um, rel=0.03)
    assert moving.frequency_hz == pytest.approx(calm.frequency_hz, rel=0.01)


def test_noise_alone_is_no_vibration() -> None:
    assert shaken(0.0, 18.0, 1.0) is None


def test_below_two_um_there_is_nothing_to_wait_for() -> None:
    found = shaken(1.8, 18.0, 0.5, noise=0.1)
    assert found is not None and found.decay_s == 0.0


def test_silent_laser_is_none() -> None:
    assert shaken(20.0, 18.0, math.nan) is None


def test_exact_on_a_clean_sine() -> None:
    t = np.arange(2000) * DT
    y = 3.0 + 0.5 * t + np.exp(-1.2 * t) * (4.0 * np.cos(140.0 * t) - 7.0 * np.sin(140.0 * t))
    fit = decaying_sine(y, DT)
    assert fit == pytest.approx((140.0 / (2 * math.pi), 1.2, 4.0, -7.0), rel=1e-6)


def recorded(
    rest: int, end: int, rows: int = 2000, dt: float = DT, **columns: np.ndarray
) -> tuple[Recording, MoveResult]:
    """A macro move whose last count comes in row `rest`, and whose laser is reset in `end`."""
    arrays = {c.name: np.zeros(rows) for c in COLUMNS}
    arrays["t"] = np.arange(rows) * dt
    arrays["macro_position"] = np.minimum(np.arange(rows), rest).astype(float)
    arrays["phase"] = np.full(rows, float(SETTLING))
    arrays["laser_reset"] = (np.arange(rows) == end).astype(float)
    arrays |= columns
    made = Recording.from_arrays(COLUMNS, [arrays[c.name] for c in COLUMNS], dt, {})
    empty = dict.fromkeys(MoveResult._fields)
    return made, MoveResult(**{**empty, "move": 0, "stage": "macro", "arrived_s": 0.1})


def swing(t: np.ndarray, amplitude: float, frequency: float, decay: float) -> np.ndarray:
    return amplitude * np.exp(-decay * t) * np.sin(2.0 * math.pi * frequency * t)


@pytest.mark.parametrize("frequency", [5.0, 12.0])
@pytest.mark.parametrize("decay", [0.5, 6.0])
@pytest.mark.parametrize("rest", [300, 317, 333, 361])
def test_the_amplitude_is_the_first_peak_after_the_creep(
    frequency: float, decay: float, rest: int
) -> None:
    """Of a clean sine, found by looking along it; strong damping moves the peak forward."""
    t = (np.arange(2000) - 300) * DT
    fine = np.linspace(0.0, 0.5 / frequency, 40_001) + (rest - 300) * DT + CREEP
    y = 4.0 + swing(t, 30.0, frequency, decay)
    found = vibration(*recorded(rest, 1900, laser=y))
    assert found is not None
    z = swing(fine, 30.0, frequency, decay)
    slope = np.diff(z)
    turn = int(np.argmax(slope[1:] * slope[:-1] <= 0.0)) + 1
    assert found.amplitude_um == pytest.approx(abs(z[turn]), rel=1e-4)
    assert found.frequency_hz == pytest.approx(frequency, rel=1e-5)
    assert found.decay_rate == pytest.approx(decay, rel=1e-4)
    assert found.rest_s == pytest.approx(rest * DT, abs=1e-12)
    # From the last count until the envelope is down to 2 um.
    wanted = math.log(30.0 / 2.0) / decay - (rest - 300) * DT
    assert found.decay_s == pytest.approx(wanted, rel=1e-3)


def test_the_settled_value_is_the_mean_of_the_last_quarter() -> None:
    """Of the rows from the creep's end to the laser's reset, the Hall reading left in."""
    t = np.arange(2000) * DT
    y = 50.0 * t + swing(t, 9.0, 20.0, 1.0)
    found = vibration(*recorded(300, 1150, laser=y))
    assert found is not None
    assert found.settled_um == pytest.approx(float(y[950:1150].mean()), abs=1e-9)


@pytest.mark.parametrize(("end", "found"), [(649, False), (650, True)])
def test_three_tenths_of_a_second_of_standing_are_needed(end: int, found: bool) -> None:
    """From the creep's end, 350 ms, to the laser's reset."""
    y = swing(np.arange(2000) * DT, 30.0, 20.0, 1.0)
    assert (vibration(*recorded(300, end, laser=y)) is not None) == found


@pytest.mark.parametrize("over", [MICRO, WAITING])
def test_rows_of_another_phase_end_the_look(over: int) -> None:
    y = swing(np.arange(2000) * DT, 30.0, 20.0, 1.0)
    phase = np.where(np.arange(2000) < 640, SETTLING, over).astype(float)
    assert vibration(*recorded(300, 1900, laser=y, phase=phase)) is None
    phase = np.where(np.arange(2000) < 660, SETTLING, over).astype(float)
    assert vibration(*recorded(300, 1900, laser=y, phase=phase)) is not None


def test_only_a_macro_move_that_arrived_is_looked_at() -> None:
    made, move = recorded(300, 1900, laser=swing(np.arange(2000) * DT, 30.0, 20.0, 1.0))
    assert vibration(made, move) is not None
    assert vibration(made, move._replace(arrived_s=None)) is None
    assert vibration(made, move._replace(stage="micro")) is None


def test_a_carriage_that_never_moved_stands_from_the_first_row_on() -> None:
    y = swing(np.arange(2000) * DT, 30.0, 20.0, 1.0)
    found = vibration(*recorded(0, 1900, laser=y, macro_position=np.zeros(2000)))
    assert found is not None and found.rest_s == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("amplitude", "decay"), [(1.9, 1.0), (30.0, -0.4)])
def test_no_time_where_the_envelope_is_low_or_grows(amplitude: float, decay: float) -> None:
    y = swing(np.arange(2000) * DT, amplitude, 20.0, decay)
    found = vibration(*recorded(0, 1900, laser=y, macro_position=np.zeros(2000)))
    assert found is not None
    assert found.decay_s == (0.0 if amplitude < 2.0 else None)


@pytest.mark.parametrize(
    ("frequency", "dt", "seen"),
    [(3.3, 1e-3, True), (2.2, 1e-3, False), (440.0, 1e-3, True), (90.0, 5e-3, True),
     (470.0, 1e-4, False)],
)  # fmt: skip
def test_frequencies_from_3_to_450_hertz_below_the_nyquist_one(
    frequency: float, dt: float, seen: bool
) -> None:
    t = np.arange(4000) * dt
    fit = decaying_sine(swing(t, 10.0, frequency, 0.7), dt)
    assert (fit is not None) == seen
    if fit is not None:
        assert fit[:2] == (pytest.approx(frequency, rel=1e-6), pytest.approx(0.7, abs=1e-4))


@given(st.floats(0.3, 3.0), st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_a_sine_within_noise_is_found_where_it_stands_out(amplitude: float, seed: int) -> None:
    """By least squares: frequency and decay within five times the Cramer-Rao bound, which for
    decay and angular frequency is sqrt(2) sigma / (A sqrt(sum of (t - mean)^2 e^(-2 d t)))."""
    t = np.arange(2000) * DT
    noise = np.random.default_rng(seed).normal(0.0, 0.05, 2000)
    fit = decaying_sine(swing(t, amplitude, 21.8, 1.15) + noise, DT)
    assert fit is not None
    weight = np.exp(-2.0 * 1.15 * t)
    spread = (weight * (t - np.average(t, weights=weight)) ** 2).sum()
    bound = math.sqrt(2.0) * 0.05 / (amplitude * math.sqrt(spread))
    assert 2.0 * math.pi * fit[0] == pytest.approx(2.0 * math.pi * 21.8, abs=5.0 * bound)
    assert fit[1] == pytest.approx(1.15, abs=5.0 * bound)


@pytest.mark.parametrize("begins", [0, 200])
@pytest.mark.parametrize("next_move", [1500, 2000])
def test_a_move_is_looked_at_from_its_first_row_to_the_next_move(
    begins: int, next_move: int
) -> None:
    """Here without a reset of the laser behind it."""
    rows = np.arange(2000)
    y = 70.0 * rows * DT + swing((rows - 300) * DT, 30.0, 20.0, 1.0)
    number = (rows >= begins).astype(float) + (rows >= next_move)
    made, move = recorded(300, 5000, laser=y, move=number, laser_reset=1.0 * (rows < begins))
    found = vibration(made, move._replace(move=1))
    assert found is not None and found.rest_s == pytest.approx(0.3, abs=1e-12)
    last = (next_move - 350) // 4
    assert found.settled_um == pytest.approx(float(y[next_move - last : next_move].mean()))
