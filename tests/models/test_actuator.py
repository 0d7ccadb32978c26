"""Both actuator models as kernels: what must hold whatever the parameters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.hysteresis import from_density, peek
from macromicro.models import actuator, heating, stressed
from macromicro.models.actuator import Actuator, Hysteresis
from macromicro.models.heating import PRINTED, Heat, Ladder, from_transfer
from macromicro.models.stressed import Stressed
from macromicro.models.weighted_gain import Weighted, weighted

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


@pytest.mark.parametrize("parts", [(30.0, 20.0, 10.0), (10.0, 30.0, 20.0), (20.0, 10.0, 30.0)])
def test_thesis_model_cools_where_it_is_warmer_than_the_goal(parts: tuple[float, ...]) -> None:
    """All three parts count: (5.9) at 1 K above what the input asks for, (5.6) at 1 K below."""
    p = THESIS
    whole = sum(p.heating[3:])
    goal = weighted(p.gain, 1.55) * whole
    for off, law in ((1.0, "cooled"), (-1.0, "heated")):
        scale = (goal + off) / 60.0
        heat = Heat(*(scale * x for x in parts))
        now = actuator.step(p, actuator.cold(p)._replace(heat=heat), 1.55, 0.02).heat
        if law == "cooled":
            wanted = heating.cooled(p.heating, heat, goal / whole, p.cool_time, 0.02)
        else:
            wanted = heating.heated(p.heating, heat, goal / whole, 0.02)
        np.testing.assert_allclose(now, wanted, rtol=1e-12)


def test_lag_gives_its_mean_heat_to_the_wires() -> None:
    """What the wires take in during a period is the integral of a heat that lags behind."""
    p = BETTER._replace(lag=0.05)
    s = stressed.cold(p)._replace(heat=40.0)
    goal, dt = stressed.static_heat(p, 1.55), 0.06
    t = np.linspace(0.0, dt, 20_001)
    taken = np.trapezoid(goal + (40.0 - goal) * np.exp(-t / p.lag), t)
    now = stressed.warmed(p, s, 1.55, 0.0, dt)
    assert now.content == pytest.approx(taken / p.ladder.c1, rel=1e-6)
    assert now.heat == pytest.approx(goal + (40.0 - goal) * np.exp(-dt / p.lag), rel=1e-12)
    cut = stressed.warmed(p, s, 1.55, 1.0, dt)
    assert cut.content == pytest.approx(40.0 * p.lag * (1.0 - np.exp(-dt / p.lag)) / p.ladder.c1)


def test_the_temperature_is_the_rooms_and_three_parts() -> None:
    """And the relays see that of the step's end."""
    s = actuator.cold(THESIS)._replace(heat=Heat(30.0, 20.0, 10.0))
    assert actuator.temperature(THESIS, s) == 25.0 + 30.0 + 20.0 + 10.0
    p = THESIS._replace(hysteresis=RELAYS._replace(low=0.2, span=3.5))
    now = actuator.step(p, actuator.cold(p)._replace(heat=Heat(40.0, 21.0, 11.0)), 1.6, 0.02)
    u = 25.0 + sum(now.heat[:3])
    assert u != 25.0 and now.memory.u == pytest.approx(u, rel=1e-15)
    fresh_memory = actuator.cold(p).memory
    assert now.x == pytest.approx(0.2 + 3.5 * peek(TABLE, fresh_memory, u), rel=1e-12)
    assert 0.2 < now.x < 3.7


def test_a_simulation_shows_each_state_before_its_step() -> None:
    out = np.empty((2, 3))
    ctrl, dt = np.array([1.6, 0.0, 1.7]), np.array([0.3, 0.2, 0.1])
    actuator._rollout(THESIS, actuator.cold(THESIS), ctrl, dt, out)
    s = actuator.cold(THESIS)
    for k in range(3):
        assert out[:, k].tolist() == [s.x, actuator.temperature(THESIS, s)]
        s = actuator.step(THESIS, s, ctrl[k], dt[k])
