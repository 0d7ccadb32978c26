"""The micro-stage's actuator on its load: Sections 5.2.2 and 5.3.2, energy, the fan."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from .drives import DT, MICRO, heat


@pytest.mark.parametrize("ctrl", [1.7, 1.8, 1.9, 5.0])
def test_the_stop_is_reached_from_1_7_volts_on(ctrl: float) -> None:
    """Section 5.2.2 (S3): 3.98 mm above 1.65 V."""
    run = heat(np.full(60000, ctrl))
    assert run.x.max() == pytest.approx(3.98e-3, abs=0.02e-3)
    assert run.x.max() <= 3.98e-3


def test_the_stop_is_not_reached_at_1_6_volts() -> None:
    """Section 5.2.2 (S3), over steps of a minute; the body goes on warming for some more."""
    run = heat(np.full(60000, 1.6))
    assert run.x.max() < 3.9e-3


def test_no_response_at_1_3_volts() -> None:
    """Section 5.3.2 (S4): under 20 um at 1.3 V, the first response between 1.3 and 1.5 V."""
    assert heat(np.full(60000, 1.3)).x.max() < 20e-6
    assert heat(np.full(60000, 1.5)).x.max() > 20e-6


def test_heat_in_is_heat_out_and_stored() -> None:
    """First law over a minute of heating, cooling and cut-offs, latent heat included."""
    ctrl = np.r_[np.full(8000, 1.9), np.full(8000, 1.5), np.zeros(6000), np.full(20000, 1.56)]
    run = heat(ctrl)
    p = MICRO.thermal
    # Within a period the wires take the mean of the power at its two ends.
    given_ = float((run.power + np.r_[0.0, run.power[:-1]]).sum()) * 0.5 * DT
    # The loss of each period is that of the body's temperature before it.
    before = np.r_[p.ambient, run.body[:-1]]
    lost = float((before - p.ambient).sum()) * DT / p.body_resistance
    stored = (
        p.wire_capacity * (run.temperature[-1] - p.ambient)
        + MICRO.wire.latent * run.austenite[-1]
        + p.plate_capacity * (run.plates[-1] - p.ambient)
        + p.body_capacity * (run.body[-1] - p.ambient)
    )
    assert given_ > 5.0
    assert abs(given_ - lost - stored) <= 1e-6 * given_


@given(st.lists(st.floats(0.0, 5.0), min_size=1, max_size=10), st.sampled_from([0.0, 1.0]))
@settings(max_examples=30, deadline=None)
def test_bounded_whatever_is_asked(ctrl: list[float], fan: float) -> None:
    """Actuator output within 0-3.98 mm, no node below ambient, CONTRACT stops overheating."""
    run = heat(np.repeat(ctrl, 400), fan=fan)
    assert run.x.min() >= -1e-9
    assert run.x.max() <= 3.98e-3
    for node in (run.temperature, run.plates, run.body):
        assert node.min() >= MICRO.thermal.ambient - 1e-9
    assert run.temperature.max() < 135.0
    assert np.all(run.power[run.cut > 0.5] == 0.0)


def test_contract_holds_full_contraction_without_overheating() -> None:
    """Section 3.2.1: at 5 V the switch keeps the wires at the stop's edge."""
    run = heat(np.full(20000, 5.0))
    late = slice(5000, None)
    assert run.x[late].min() > 3.96e-3
    assert 0.05 < run.cut[late].mean() < 0.95
    assert run.temperature[late].max() < 125.0


def test_the_fan_cools_plates_and_body_and_quickens_extension() -> None:
    """Section 6.3.1: cooler base temperature, faster return."""
    ctrl = np.tile(np.r_[np.full(4000, 1.7), np.zeros(4000)], 20)
    still, blown = heat(ctrl), heat(ctrl, fan=1.0)
    assert blown.plates[-1] < still.plates[-1] - 1.0
    assert blown.body[-1] < still.body[-1]
    back = [int(np.argmax(run.x[-4000:] < 20e-6)) for run in (still, blown)]
    assert 0 < back[1] < back[0]


def test_warming_slows_the_extension() -> None:
    """Section 6.3, Appendix D: the base temperature rises from cycle to cycle."""
    run = heat(np.tile(np.r_[np.full(4000, 1.7), np.zeros(4000)], 20))
    back = [int(np.argmax(run.x[8000 * k + 4000 : 8000 * k + 8000] < 20e-6)) for k in (0, 19)]
    assert back[1] > 1.1 * back[0] > 0


def test_halving_the_step_leaves_the_contraction_at_constant_ctrl() -> None:
    """By no more than 0.1 um, two seconds after each of three steps of CTRL."""
    levels = (1.575, 1.5, 1.56)
    ends = [
        heat(np.repeat(levels, 2000 * n), dt=DT / n).x[2000 * n - 1 :: 2000 * n] for n in (1, 2)
    ]
    assert np.abs(ends[0] - ends[1]).max() <= 0.1e-6
