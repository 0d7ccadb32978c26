"""The better actuator model step by step: Clausius-Clapeyron, latent heat, three nodes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.hysteresis import advance, peek
from macromicro.models import stressed
from macromicro.models.stressed import StressedState

from .test_actuator import BETTER

N = BETTER.ladder
HALF = 78.0  # degC of relay input, on the way up: some of the relays are over


def warm(u: float = HALF) -> StressedState:
    """In the midst of the transformation, wires, plates and body at temperatures of their own."""
    s = stressed.cold(BETTER)
    memory, share = advance(BETTER.hysteresis.table, s.memory, 95.0)
    memory, share = advance(BETTER.hysteresis.table, memory, u)
    content = u + 0.5 + 0.8 * 4.0 * share - 25.0 + 20.0 * share
    return StressedState(60.0, 0.0, content - 20.0 * share, 9.0, 4.0, content, memory, 4.0 * share)


def test_a_cold_wire_is_extended_and_stressed() -> None:
    s = stressed.cold(BETTER._replace(hysteresis=BETTER.hysteresis._replace(low=0.3)))
    assert s[:6] == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0) and s.x == 0.3
    assert s.memory.u == 25.0 - 0.5


@pytest.mark.parametrize("ctrl", [0.0, 1.25, 1.3, 1.5, 1.57, 1.6, 1.75, 1.8, 2.5])
def test_static_heat_is_straight_between_the_points_and_held_beyond(ctrl: float) -> None:
    wanted = np.interp(ctrl, BETTER.volts, BETTER.heat)
    assert stressed.static_heat(BETTER, ctrl) == pytest.approx(float(wanted))


@pytest.mark.parametrize("u", [40.0, 70.0, 85.0, 93.0])
def test_content_is_temperature_with_stress_and_latent_heat(u: float) -> None:
    """T = u + shift + stiffening x (Clausius-Clapeyron), and the latent share above it."""
    memory = warm().memory
    share = peek(BETTER.hysteresis.table, memory, u)
    wanted = (u + 0.5 + 0.8 * 4.0 * share) - 25.0 + 20.0 * share
    assert stressed.content_at(BETTER, memory, u) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("more", [0.0, 1e-3, 0.3, 4.0, 30.0, 90.0, -1e-3, -0.3, -4.0, -30.0, -60.0])
def test_the_relay_input_is_that_which_has_the_content(more: float) -> None:
    """On heating and on cooling, across many relays or none."""
    for u in (50.0, HALF, 90.0):
        memory = warm(u).memory
        wanted = stressed.content_at(BETTER, memory, memory.u) + more
        found = stressed._relay_input(BETTER, memory, wanted)
        assert stressed.content_at(BETTER, memory, found) == pytest.approx(wanted, abs=2e-9)
        assert (found - memory.u) * more >= 0.0


@pytest.mark.parametrize(
    ("x", "before", "closed"),
    [(3.94, 0.0, 0.0), (3.94, 1.0, 1.0), (3.95, 0.0, 1.0), (3.93, 1.0, 1.0), (3.929, 1.0, 0.0)],
)
def test_contract_closes_and_opens_with_its_own_hysteresis(
    x: float, before: float, closed: float
) -> None:
    s = stressed.step(BETTER, warm()._replace(x=x, cut=before), 1.6, 0.01)
    assert s.cut == closed
    lag = math.exp(-0.01 / 0.003)
    goal = (1.0 - closed) * 84.0
    assert s.heat == pytest.approx(goal + (60.0 - goal) * lag)


@pytest.mark.parametrize("lag", [0.0, 0.003, 0.4])
@pytest.mark.parametrize("cut", [0.0, 0.25, 1.0])
def test_heat_runs_from_the_wires_to_plates_body_and_air(lag: float, cut: float) -> None:
    """First law for each node; wires and relays agree about what the content is."""
    p, s, dt = BETTER._replace(lag=lag), warm(), 0.02
    new = stressed.warmed(p, s, 1.6, cut, dt)
    goal = (1.0 - cut) * 84.0
    left = math.exp(-dt / lag) if lag else 0.0
    assert new.heat == pytest.approx(goal + (60.0 - goal) * left)
    mean = goal + (60.0 - goal) * (1.0 - left) * lag / dt  # of an exponential over the step
    flows = ((s.wire - 9.0) / N.r1, (9.0 - 4.0) / N.r2, 4.0 / N.r3)
    assert N.c1 * (new.content - s.content) / dt == pytest.approx(mean - flows[0])
    assert N.c2 * (new.plates - 9.0) / dt == pytest.approx(flows[0] - flows[1])
    assert N.c3 * (new.body - 4.0) / dt == pytest.approx(flows[1] - flows[2])
    share = new.x / 4.0
    assert new.wire == pytest.approx(new.content - 20.0 * share)
    assert new.memory.u == pytest.approx(25.0 + new.wire - 0.5 - 0.8 * new.x, abs=1e-8)
    assert new.cut == cut


def test_a_simulation_shows_each_state_before_its_step() -> None:
    """In degC, with the switch as it was measured where it was."""
    cut = np.array([math.nan, 1.0, 0.5, math.nan])
    ctrl, dt = np.array([1.6, 1.7, 1.8, 1.5]), np.array([0.01, 0.02, 0.01, 0.02])
    found = np.empty((3, 4))
    s = start = warm()
    stressed._rollout(BETTER, start, ctrl, cut, dt, found)
    s = warm()
    for k in range(4):
        assert found[:, k] == pytest.approx([s.x, 25.0 + s.wire, 25.0 + s.body], rel=1e-12)
        own = 1.0 if s.x >= 3.95 else 0.0
        s = stressed.warmed(BETTER, s, ctrl[k], own if math.isnan(cut[k]) else cut[k], dt[k])


@pytest.mark.parametrize("heat", [0.5, 1.7, 20.0, 60.0, 86.5, 120.0, 205.0])
def test_the_level_for_a_heat_gives_that_heat(heat: float) -> None:
    if heat >= BETTER.heat[-1]:
        assert stressed.level(BETTER, heat) == BETTER.volts[-1]
    else:
        assert stressed.static_heat(BETTER, stressed.level(BETTER, heat)) == pytest.approx(heat)


def test_no_heat_needs_no_volts_and_a_level_part_of_the_map_its_first() -> None:
    flat = BETTER._replace(
        volts=np.array([1.0, 1.5, 2.0, 2.5]), heat=np.array([0.0, 9.0, 9.0, 10.0])
    )
    assert stressed.level(flat, 0.0) == 0.0 == stressed.level(flat, -1.0)
    assert stressed.level(flat, 9.0) == 1.5 and stressed.level(flat, 9.5) == 2.25
    assert stressed.level(flat, 10.0) == 2.5 == stressed.level(flat, 99.0)
