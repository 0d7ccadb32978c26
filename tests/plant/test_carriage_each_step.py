"""One step of the carriage against the laws that it solves."""

from __future__ import annotations

import pytest

from macromicro.plant import belt, carriage, friction, motor
from macromicro.plant.carriage import MacroState
from macromicro.plant.friction import Worn

from .drives import MACRO

H = 5e-5
P = MACRO.carriage
INSIDE = 0.1
MOVING = MacroState(INSIDE, 0.21, 4e-6, 0.8, 1.5e-5, 2e-3, 7.0, Worn(0.3, 1.5))


@pytest.mark.parametrize("speed", [0.0, 0.3, -0.3])
@pytest.mark.parametrize(("edge", "depth"), [(P.stop_low, -2e-3), (P.stop_high, 3e-3)])
def test_an_end_stop_is_a_spring_and_a_damper_at_the_steps_end(
    edge: float, depth: float, speed: float
) -> None:
    """Of the new place and the new speed, so that no step is too long for it."""
    force, slope = carriage.stop_terms(P, edge + depth, H)
    after = depth + H * speed
    assert force - slope * speed == pytest.approx(
        -P.stop_stiffness * after - P.stop_damping * speed
    )
    assert carriage.stop_terms(P, edge, H) == (0.0, 0.0)
    assert carriage.stop_terms(P, INSIDE, H) == (0.0, 0.0)


@pytest.mark.parametrize("x", [INSIDE, P.stop_low - 1e-3, P.stop_high + 1e-3])
@pytest.mark.parametrize("volts", [0.0, 12.0, -20.0])
@pytest.mark.parametrize("v", [0.21, -0.4])
def test_a_step_balances_momentum_and_voltage(x: float, volts: float, v: float) -> None:
    """(4.1) with friction, belt and stops, all at the new speed; the belt as it was before."""
    s = MOVING._replace(x=x, v=v)
    offset = 0.4
    new = carriage.substep(MACRO, s, volts, offset, H)
    m = MACRO.motor
    # L di/dt = V - R i - K_b omega
    assert m.inductance * (new.i - s.i) / H == pytest.approx(
        volts - m.resistance * new.i - m.constant * new.v / m.pulley, rel=1e-9
    )
    p = MACRO.friction
    z0, z1, f0, f1 = friction.bristle_terms(p, p.bristle, p.bristle_damping, s.z, s.v, offset, H)
    e0, e1 = carriage.stop_terms(P, x, H)
    force = (
        motor.force(m, new.i)
        - (f0 + f1 * new.v)
        + (e0 - e1 * new.v)
        + belt.reaction(MACRO.belt, P.mass, s.q, s.qv)
        - MACRO.friction.viscous * new.v
    )
    assert P.mass * (new.v - s.v) / H == pytest.approx(force, rel=1e-9)
    assert new.x == pytest.approx(x + H * new.v, rel=1e-15)
    assert new.z == pytest.approx(z0 + z1 * new.v, rel=1e-12)
    assert (new.q, new.qv) == belt.step(MACRO.belt, s.q, s.qv, new.v - s.v, H)
    assert new.accel == s.accel


@pytest.mark.parametrize(
    ("changed", "volts", "stands"),
    [
        ({}, 0.0, True), ({"v": -1.9e-4}, 0.0, True), ({"v": 1.9e-4}, 0.0, True),
        ({"v": 2.1e-4}, 0.0, False), ({"v": -2.1e-4}, 0.0, False), ({}, 0.1, False),
        ({"i": 2e-6}, 0.0, False), ({"i": -2e-6}, 0.0, False), ({"z": 2e-6}, 0.0, False),
        ({"z": -2e-6}, 0.0, False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("substeps", [5, 20, 30])
def test_a_carriage_that_stands_needs_a_tenth_of_the_steps(
    changed: dict[str, float], volts: float, stands: bool, substeps: int
) -> None:
    """But one. The acceleration told is the mean over all of them."""
    s = carriage.at_rest(INSIDE)._replace(q=1e-6, qv=1e-4)._replace(**changed)
    dt = 1e-3
    steps = max(substeps // 10, 1) if stands else substeps
    offset = friction.ripple(MACRO.friction, s.x)
    expected = s
    for _ in range(steps):
        expected = carriage.substep(MACRO, expected, volts, offset, dt / steps)
    found = carriage.advance(MACRO, s, volts, dt, substeps)
    assert found == expected._replace(
        accel=(expected.v - s.v) / dt,
        worn=friction.worn(MACRO.friction, s.worn, expected.v, dt),
    )
