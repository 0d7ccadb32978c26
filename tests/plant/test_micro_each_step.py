"""One step of the actuator against the laws that it solves."""

from __future__ import annotations

import pytest

from macromicro.plant import driver, micro, thermal, wire
from macromicro.plant.micro import MicroState

from .drives import MICRO


def warm(cut: float = 0.0) -> MicroState:
    """The actuator half-way, each part at another temperature."""
    s = micro.cold(MICRO, 30.0)
    alloy = wire.heated(MICRO.wire, MICRO.load, MICRO.table, s.wire, 0.4, 0.0,
                        MICRO.thermal.wire_capacity)  # fmt: skip
    return s._replace(power=0.9, flow=0.5, cut=cut, plates=45.0, body=38.0, wire=alloy)


def test_a_cold_actuator_is_at_one_temperature_and_extended() -> None:
    s = micro.cold(MICRO, 30.0)
    assert s[:5] == (0.0, 0.0, 0.0, 30.0, 30.0)
    # Clausius-Clapeyron: the relays see less the load beyond that of the kiln.
    u = 30.0 - MICRO.wire.shift * (MICRO.load.preload - MICRO.wire.reference_load)
    assert s.wire[:6] == (30.0, u, 1.0, 0.0, 0.0, 30.0)


@pytest.mark.parametrize("fan", [0.0, 1.0])
@pytest.mark.parametrize("inertia", [0.0, 0.2])
def test_a_step_of_the_actuator_moves_heat_down_the_ladder(fan: float, inertia: float) -> None:
    """First law for each node: mean power in, the wires' flow by Adams-Bashforth."""
    dt, t = 1e-3, MICRO.thermal
    s = warm()
    x = s.wire.x
    f1, f2, f3 = thermal.flows(t, s.wire.temperature, s.plates, s.body, fan, 1.0)
    out = 1.5 * f1 - 0.5 * s.flow
    power = driver.delivered(MICRO.driver, s.power, 1.9, 0.0, dt)
    again = warm()
    gain = (0.5 * (s.power + power) - out) * dt
    alloy = wire.heated(MICRO.wire, MICRO.load, MICRO.table, again.wire, gain, inertia,
                        t.wire_capacity)  # fmt: skip
    new = micro.advance(MICRO, s, 1.9, fan, inertia, dt)
    assert (new.power, new.flow, new.cut) == (power, f1, 0.0)
    assert t.plate_capacity * (new.plates - 45.0) / dt == pytest.approx(out - f2, rel=1e-9)
    assert t.body_capacity * (new.body - 38.0) / dt == pytest.approx(f2 - f3, rel=1e-9)
    assert new.wire[:6] == pytest.approx(alloy[:6], rel=1e-12)
    assert (new.wire.x > x) == (inertia == 0.0)  # a heavier load stretches


def test_contract_takes_the_heat_away_at_once() -> None:
    s = warm()
    s = s._replace(wire=s.wire._replace(x=MICRO.driver.contract_on))
    new = micro.advance(MICRO, s, 1.9, 0.0, 0.0, 1e-3)
    assert (new.cut, new.power) == (1.0, 0.0)
