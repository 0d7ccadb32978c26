"""Both actuator models as kernels: what must hold whatever the parameters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.hysteresis import from_density
from macromicro.models import actuator, stressed
from macromicro.models.actuator import Actuator, Hysteresis
from macromicro.models.heating import PRINTED, Ladder, from_transfer
from macromicro.models.stressed import Stressed
from macromicro.models.weighted_gain import Weighted

# Heating thresholds crowd below 110 degC, cooling ones 15 to 50 K lower.
TABLE = from_density(
    lambda up, down: np.where(
        (up < 110.0) & (up > 45.0) & (up - down > 15.0) & (up - down < 50.0) & (down > 30.0),
        np.exp(up / 10.0),
        0.0,
    ),
    20.0,
    1.0,
    101,
)
RELAYS = Hysteresis(TABLE, 0.0, 4.0)
THESIS = Actuator(Weighted(), from_transfer(*PRINTED), 1.0, 25.0, RELAYS)
BETTER = Stressed(
    volts=np.array([1.25, 1.5, 1.6, 1.8]),
    heat=np.array([0.0, 58.0, 84.0, 150.0]),
    lag=0.003,
    ladder=Ladder(0.75, 0.73, 44.0, 0.2, 1700.0, 0.07),
    latent=20.0,
    shift=0.5,
    stiffening=0.8,
    cut_on=3.95,
    cut_off=3.93,
    ambient=25.0,
    hysteresis=RELAYS,
)
voltages = st.lists(st.floats(0.0, 2.0), min_size=1, max_size=12)


@given(voltages)
def test_models_stay_within_their_stroke(volts: list[float]) -> None:
    ctrl = np.repeat(volts, 60)
    for x in (actuator.simulate(THESIS, ctrl, 0.02)[0], stressed.simulate(BETTER, ctrl, 0.02)[0]):
        assert x.min() >= -1e-9
        assert x.max() <= 4.0 + 1e-9


def test_interpreted_and_compiled_agree() -> None:
    ctrl = np.repeat([1.6, 0.0, 1.8, 1.4], 100)
    fast = actuator.simulate(THESIS, ctrl, 0.01)[0]
    better = stressed.simulate(BETTER, ctrl, 0.01)[0]
    a, b = actuator.cold(THESIS), stressed.cold(BETTER)
    for k, volts in enumerate(ctrl):
        assert a.x == pytest.approx(fast[k], rel=1e-12)
        assert b.x == pytest.approx(better[k], rel=1e-12)
        a = actuator.step(THESIS, a, float(volts), 0.01)
        b = stressed.step(BETTER, b, float(volts), 0.01)
    assert actuator.temperature(THESIS, a) > 25.0


def test_thesis_model_cools_with_one_time_constant() -> None:
    """(5.9): from anywhere, 63 % of the fall in a second."""
    ctrl = np.r_[np.full(1000, 1.575), np.zeros(101)]
    _, warm = actuator.simulate(THESIS, ctrl, 0.01)
    assert (warm[1100] - 25.0) == pytest.approx((warm[1000] - 25.0) * np.exp(-1.0), rel=1e-6)


def test_heat_is_kept() -> None:
    """What went in is what the three nodes and the transformation hold, plus what left."""
    n = BETTER.ladder._replace(r3=1e12)
    closed = BETTER._replace(ladder=n, lag=0.0, cut_on=np.inf, cut_off=np.inf)
    s = stressed.cold(closed)
    given_heat = 0.0
    for _ in range(2000):
        given_heat += stressed.static_heat(closed, 1.6) * 0.01
        s = stressed.step(closed, s, 1.6, 0.01)
    held = n.c1 * s.content + n.c2 * s.plates + n.c3 * s.body
    assert held == pytest.approx(given_heat, rel=1e-9)
    assert s.content == pytest.approx(s.wire + closed.latent * s.x / 4.0)


def test_relays_see_temperature_less_stress() -> None:
    """Clausius-Clapeyron: x is the table's output at T - shift - stiffening x."""
    s = stressed.cold(BETTER)
    for _ in range(3000):
        s = stressed.step(BETTER, s, 1.58, 0.01)
    u = 25.0 + s.wire - BETTER.shift - BETTER.stiffening * s.x
    assert s.memory.u == pytest.approx(u, abs=1e-6)
    assert 0.5 < s.x < 3.9


def test_contract_cuts_and_a_measured_cut_is_followed() -> None:
    ctrl = np.full(6000, 1.8)
    x, wire, _ = stressed.simulate(BETTER, ctrl, 0.002)
    _, free, _ = stressed.simulate(BETTER, ctrl, 0.002, np.zeros(6000))
    assert x.max() >= BETTER.cut_on
    assert wire[-1] < 120.0 < free[-1]
    _, off, _ = stressed.simulate(BETTER, ctrl, 0.002, np.ones(6000))
    assert off.max() == pytest.approx(25.0)


def test_warm_plates_slow_the_cooling() -> None:
    """Section 5.2.2, (5.9): the longer the hold, the slower the cooling."""

    def time(hold: int) -> float:
        x = stressed.simulate(BETTER, np.r_[np.full(hold, 1.6), np.zeros(500)], 0.01)[0]
        return 0.01 * float(np.argmax(x[hold:] < 0.3))

    assert time(20_000) > 1.1 * time(500)
