"""Velocity and acceleration of a programme's set point, and that a law is given them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro import kernel, simulate
from macromicro.control import supervisor
from macromicro.control.settings import Control, prepare
from macromicro.control.supervisor import Plan
from macromicro.motion import Trajectory, s_curve
from macromicro.programme import FEWEST, LONGEST, Programme, follow
from macromicro.programme.rates import rates
from macromicro.settings import Settings
from macromicro.types import Sample
from tests.control.own_laws import HERE, Memory

PER_METRE = 14_000.0


@given(st.floats(0.02, 0.15), st.floats(0.05, 0.3), st.floats(0.5, 3.0))
def test_those_of_a_profile(way: float, speed: float, acceleration: float) -> None:
    profile = s_curve(way, speed, acceleration, 50.0)
    made = follow(Trajectory.from_profile(profile), hold=0.3)
    velocity, change = rates(made)
    assert velocity.shape == change.shape == made.start.shape
    true = [profile.at(t) for t in made.start]
    exact = np.array([m.velocity for m in true]) * PER_METRE
    # Second differences over periods of 1 ms, of a motion of bounded jerk.
    assert np.max(np.abs(velocity - exact)) <= 50.0 * PER_METRE * 1e-3**2
    sought = np.array([m.acceleration for m in true]) * PER_METRE
    assert np.max(np.abs(change - sought)) <= 1.5 * 50.0 * PER_METRE * 1e-3
    assert velocity[-1] == change[-1] == 0.0  # this target is held


def steps(start: list[float], target: list[float], stage: list[int] | None = None) -> Programme:
    n = len(start)
    which = np.zeros(n, np.int64) if stage is None else np.array(stage)
    hold = np.diff(start, append=start[-1] + 1.0)
    return Programme("", np.array(start), which, np.array(target), hold, start[-1] + 1.0, "a test")


def test_moves_have_none() -> None:
    n = 3 * FEWEST
    few = steps([0.01 * k for k in range(FEWEST - 1)], [1.0 * k for k in range(FEWEST - 1)])
    slow = steps([1.001 * LONGEST * k for k in range(n)], [1.0 * k for k in range(n)])
    untimed = steps([0.0] * n, [1.0 * k for k in range(n)])._replace(
        start=np.full(n, math.nan), end=math.nan
    )
    for made in (few, slow, untimed):
        velocity, acceleration = rates(made)
        assert velocity.shape == acceleration.shape == (0,)


def test_those_of_each_stage_and_each_piece_alone() -> None:
    n = FEWEST
    t = [0.01 * k for k in range(n)] + [9.0 + 0.01 * k for k in range(2 * n)]
    stage = [0] * (2 * n) + [1] * n
    ramp = (
        [5.0 * x for x in t[:n]] + [-3.0 * x for x in t[n : 2 * n]] + [0.1 * x for x in t[2 * n :]]
    )
    velocity, acceleration = rates(steps(t, ramp, stage))
    for k, slope in enumerate((5.0, -3.0, 0.1)):
        rows = slice(k * n, (k + 1) * n - 1)
        assert velocity[rows] == pytest.approx(slope)
        assert velocity[(k + 1) * n - 1] == 0.0
    assert acceleration == pytest.approx(0.0, abs=1e-6)


def plan(velocity: Any, acceleration: Any) -> Plan:
    columns = ([0.0, 1.0], [0, 1], [5.0, 1e-3], [1.0, 1.0])
    made = Plan(*(np.array(c) for c in columns), 2.0)
    return made._replace(velocity=np.array(velocity), acceleration=np.array(acceleration))


@pytest.mark.parametrize("step", [supervisor.step, kernel.compiled(supervisor.step)])
def test_the_supervisor_gives_them_to_the_macro_law(step: Any) -> None:
    """To one of another package, which looks at them; it takes m."""
    control = Control().joined(f"{HERE}:sliding", "a test")
    p = prepare(control)
    p = p._replace(macro=p.macro._replace(dead_zone=0.0))
    first = supervisor.begin(0.0, p)
    sample = Sample(0.0, 0.0, 2.5, *[math.nan] * 3)
    outputs = [
        step(p, plan(v, a), first, sample, 1e-3)[2].motor
        for v, a in (([], []), ([9.0, 0.0], [0.0, 0.0]), ([-9000.0, 7.0], [0.0, 0.0]))
    ]
    off = 50.0 * 5.0 / PER_METRE
    given = [2.0 * min(max((off + v / PER_METRE) / 0.1, -1.0), 1.0) for v in (0.0, 9.0, -9000.0)]
    assert outputs == pytest.approx(given)


def test_a_law_that_sees_the_speed_follows_a_profile_more_closely() -> None:
    settings = Settings().with_("controller.macro_law", f"{HERE}:sliding")
    way = s_curve(0.1, 0.15, 1.0, 20.0)
    programme = follow(Trajectory.from_profile(way), hold=0.5)
    rolled = simulate.plan(programme)
    assert rolled.velocity.max() == pytest.approx(0.15 * PER_METRE, rel=1e-3)
    worst = {}
    for name, made in (("seen", rolled), ("hidden", rolled._replace(velocity=np.empty(0)))):
        worst[name] = _worst(settings, made)
    assert worst["seen"] < 0.5 * worst["hidden"]


def _worst(settings: Settings, plan: Plan) -> float:
    """The largest distance [counts] of a carriage that is a double integrator with friction."""
    p = prepare(settings.controller)
    p = p._replace(macro=p.macro._replace(dead_zone=0.0))
    x = v = 0.0
    s, worst = supervisor.begin(0.0, p), 0.0
    assert isinstance(s.macro[-1].memory, Memory)
    for k in range(round(plan.end / 1e-3)):
        sample = Sample(k * 1e-3, math.floor(x * PER_METRE), 2.5, *[math.nan] * 3)
        s, command, out = supervisor.step(p, plan, s, sample, 1e-3)
        v += (3.0 * out.motor - 8.0 * v) * 1e-3
        x += v * 1e-3
        worst = max(worst, abs(command.macro_reference - x * PER_METRE))
    return worst
