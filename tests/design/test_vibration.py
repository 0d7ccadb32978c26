"""Residual vibration (Section 6.2, Figure 6.3) found again in made-up laser readings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.columns import COLUMNS
from macromicro.control.supervisor import DONE, MACRO, SETTLING
from macromicro.design.response import moves
from macromicro.design.vibration import CREEP, Vibration, decaying_sine, vibration
from macromicro.programme import Programme
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
