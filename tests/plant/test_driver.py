"""The actuator's driver: Section 3.2.1 and the steady gain of Section 5.2.2."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import driver
from macromicro.plant.driver import Driver

SPEC = Driver()
P = driver.prepare(SPEC)
ctrl = st.floats(-1.0, 6.0)


@given(ctrl, ctrl)
def test_heat_never_falls_with_ctrl(a: float, b: float) -> None:
    """Figure 5.14: the gain rises over its whole range."""
    low, high = sorted((a, b))
    assert driver.heat(P, low) <= driver.heat(P, high) + 1e-15


@given(ctrl)
def test_heat_is_bounded(u: float) -> None:
    """Section 5.3.2: above 1.8 V little changes; the supply bounds the heat."""
    assert 0.0 <= driver.heat(P, u) <= SPEC.map_heat[-1]


def test_map_passes_through_its_points_and_is_straight_between() -> None:
    for a, b in zip(range(len(SPEC.map_ctrl)), range(1, len(SPEC.map_ctrl)), strict=False):
        assert driver.heat(P, SPEC.map_ctrl[a]) == pytest.approx(SPEC.map_heat[a])
        middle = 0.5 * (SPEC.map_ctrl[a] + SPEC.map_ctrl[b])
        assert driver.heat(P, middle) == pytest.approx(0.5 * (SPEC.map_heat[a] + SPEC.map_heat[b]))


def test_no_heat_at_rest_and_little_at_1_3_volts() -> None:
    """Section 5.3.2 (S4): no response below 1.3 V."""
    assert driver.heat(P, 0.0) == 0.0
    assert driver.heat(P, 1.3) < 0.1 * driver.heat(P, 1.5)


@given(st.floats(1.0, 12.0), st.floats(1.3, 5.0))
def test_heat_goes_with_the_supply_squared(supply: float, u: float) -> None:
    """Joule heating, (2.1): Appendix D's 5 V give (5/4)^2 of the heat at 4 V."""
    other = driver.prepare(SPEC._replace(supply=supply))
    assert driver.heat(other, u) == pytest.approx((supply / 4.0) ** 2 * driver.heat(P, u))


def test_contract_closes_before_the_stop_and_opens_with_hysteresis() -> None:
    """Section 3.2.1: CONTRACT at full contraction."""
    on = off = None
    state = 0.0
    for x in [k * 1e-7 for k in range(39500, 39800)]:
        state = driver.contract(P, state, x)
        if state == 1.0 and on is None:
            on = x
    assert state == 1.0
    for x in [k * 1e-7 for k in range(39800, 39500, -1)]:
        state = driver.contract(P, state, x)
        if state == 0.0 and off is None:
            off = x
    assert on == pytest.approx(SPEC.contract_on, abs=2e-7)
    assert off == pytest.approx(SPEC.contract_off, abs=2e-7)
    assert off < on < 3.98e-3


@given(st.floats(0.0, 2.0), ctrl, st.floats(1e-6, 1.0))
def test_contract_cuts_the_current_at_once(power: float, u: float, dt: float) -> None:
    """Section 3.2.1: the signal halts the current flow, whatever CTRL asks."""
    assert driver.delivered(P, power, u, 1.0, dt) == 0.0


def test_heat_follows_ctrl_with_a_first_order_lag() -> None:
    """63 % after one lag, for one long or many short steps alike."""
    goal = driver.heat(P, 1.6)
    assert driver.delivered(P, 0.0, 1.6, 0.0, SPEC.lag) == pytest.approx(goal * (1 - math.exp(-1)))
    power = 0.0
    for _ in range(10):
        power = driver.delivered(P, power, 1.6, 0.0, SPEC.lag / 10)
    assert power == pytest.approx(goal * (1 - math.exp(-1)))
    assert driver.delivered(driver.prepare(SPEC._replace(lag=0.0)), 0.0, 1.6, 0.0, 1e-3) == goal
