"""Models of the macro-stage: (4.2)-(4.6), Figures 4.9 and 4.14."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from macromicro.control import deadzone
from macromicro.errors import InputError
from macromicro.models import macro
from macromicro.models.macro import (
    INITIAL,
    LINEAR,
    TUNED,
    Linear,
    MacroModel,
    MacroModelState,
    Motor,
)

VOLTS = st.floats(-10.0, 10.0)
MOTOR = Motor(ka=4.0, r=15.0, kb=0.065, kt=0.065, b=1e-5, j=7e-6, klin=56.0)


def test_position_model_as_printed() -> None:
    """(4.4)."""
    num, den = macro.position_transfer(Linear())
    assert num == pytest.approx([0.16572], rel=1e-12)
    assert den == pytest.approx([1.0, -1.95833, 0.95833], rel=1e-12)


def test_discrete_motor() -> None:
    """(4.3) from (4.2) as scipy holds an input; a = -exp(..), so the pole is positive."""
    gain, pole = macro.transfer(MOTOR)
    assert pole == pytest.approx((1e-5 * 15.0 + 0.065**2) / (7e-6 * 15.0))
    found = macro.discretise(gain, pole, 1e-3)
    num, den, _ = cont2discrete(([gain], [1.0, pole]), 1e-3)
    assert found.b == pytest.approx(float(num[0, 1]), rel=1e-9)
    assert found.a == pytest.approx(float(den[1]), rel=1e-12)
    assert found.a < 0.0


def test_printed_pole() -> None:
    """a of Section 4.2.5 is a pole of 42.56 rad/s and a gain of 3977 counts/s/V."""
    found = macro.discretise(3977.0 * 42.56, 42.56, 1e-3)
    assert found.a == pytest.approx(-0.95833, abs=2e-5)
    assert found.b == pytest.approx(165.72, rel=1e-3)


@given(VOLTS)
def test_the_inverse_undoes_the_dead_zone(volts: float) -> None:
    """Figure 4.9: within the limit, exactly linear from end to end."""
    lifted = deadzone.inverse(3.0, volts)
    assert macro.dead_zone(3.0, lifted) == pytest.approx(volts, abs=1e-12)
    assert macro.net_volts(MacroModel(kind=LINEAR), lifted) == pytest.approx(volts, abs=1e-12)
    cut = min(max(volts, -2.0), 2.0)
    assert macro.net_volts(MacroModel(kind=INITIAL), lifted) == pytest.approx(cut, abs=1e-12)


@given(st.floats(1e-3, 2.0))
def test_jump(volts: float) -> None:
    """(4.5) with the inverse before it, odd; Figure 4.14: nothing at 3 V, a0 just above."""
    model = MacroModel(kind=TUNED)
    there, back = (macro.net_volts(model, sign * (3.0 + volts)) for sign in (1.0, -1.0))
    assert there == pytest.approx(0.364 + 0.636 * volts, abs=1e-9)
    assert back == -there
    assert macro.jump_zone(3.0, 0.364, 0.636, 3.0) == 0.0
    assert macro.jump_zone(3.0, 0.364, 0.636, math.nextafter(3.0, 4.0)) > 0.364


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=40))
def test_simulation_is_the_transfer_function(volts: list[float]) -> None:
    """(4.4) as a filter; the compiled rollout and interpreted steps agree."""
    u = np.array(volts)
    motor = np.array([deadzone.inverse(3.0, v) for v in volts])
    model = MacroModel(kind=LINEAR)
    expected = lfilter([0.0, 0.0, 0.16572], [1.0, -1.95833, 0.95833], u)
    found = macro.simulate(model, motor, start=7.0)
    np.testing.assert_allclose(found, 7.0 + expected, atol=1e-9)
    s = MacroModelState(7.0, 0.0)
    for k, v in enumerate(motor):
        assert found[k] == pytest.approx(s.x, rel=1e-12)
        s = macro.step(model, s, v)


def test_bad_motor() -> None:
    with pytest.raises(InputError, match="above 0"):
        macro.transfer(MOTOR._replace(j=0.0))
    with pytest.raises(InputError, match="above 0"):
        macro.discretise(1.0, -1.0, 1e-3)


@given(width=st.floats(0.0, 5.0), a0=st.floats(0.0, 2.0), delta=st.floats(0.0, 2.0), volts=VOLTS)
def test_jump_zone_is_the_jump_beyond_the_dead_zone(
    width: float, a0: float, delta: float, volts: float
) -> None:
    """Bit for bit, on the edges, too."""
    for v in (volts, width, -width, 0.0, -0.0):
        assert macro.jump_zone(width, a0, delta, v) == macro.jump(
            a0, delta, macro.dead_zone(width, v)
        )
