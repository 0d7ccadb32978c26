"""Velocity and acceleration of a programme's set point, and that a law is given them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro import kernel, simulate
from macromicro.control import micro, supervisor
from macromicro.control.settings import Control, prepare
from macromicro.control.supervisor import Plan
from macromicro.motion import Trajectory, s_curve
from macromicro.programme import FEWEST, LONGEST, Limits, Programme, follow, load
from macromicro.programme.rates import rates, turns
from macromicro.settings import Settings
from macromicro.types import Sample
from tests.control.own_laws import HERE, Memory

PER_METRE = 14_000.0
STEPS = (
    supervisor.step,
    pytest.param(kernel.compiled(supervisor.step), marks=pytest.mark.slow),
)


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


@pytest.mark.parametrize("before", ["", '[[moves]]\nmacro = "0 mm"\nhold = "1 s"\n'])
def test_those_of_a_written_profile_are_its_polynomials(tmp_path: Path, before: str) -> None:
    file = tmp_path / "p.toml"
    file.write_text(
        before + '[[profiles]]\nmacro = "50 mm"\nvelocity = "0.1 m/s"\n'
        'acceleration = "0.7 m/s^2"\njerk = "13 m/s^3"\nhold = "1 s"\n'
    )
    made = load(file, Limits(0.0, 2800.0, 0.0, 3.8e-3, PER_METRE))
    velocity, acceleration = rates(made)
    exact = s_curve(0.05, 0.1, 0.7, 13.0).at(1e-3 * np.arange(1, made.profiles[0].behind + 1))
    rows = slice(made.profiles[0].first, made.profiles[0].behind)
    n = rows.stop - rows.start
    assert velocity[rows] == pytest.approx(PER_METRE * exact.velocity[:n], abs=1e-9)
    assert acceleration[rows] == pytest.approx(PER_METRE * exact.acceleration[:n], abs=1e-9)


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


@given(st.floats(0.2, 2.0), st.integers(2, 4), st.booleans())
def test_a_set_point_turns_where_it_goes_back(seconds: float, count: int, wave: bool) -> None:
    """A sine or a triangle, its targets rounded so that they tremble at the top."""
    t = np.arange(0.0, count * seconds, 0.002)
    phase = 2.0 * np.pi * t / seconds
    place = np.cos(phase) if wave else np.arccos(np.cos(phase))
    tremble = np.random.default_rng(1).uniform(-2e-4, 2e-4, len(t))
    until = turns(steps(t.tolist(), (5.0 + place + tremble).tolist()))
    turning = 0.5 * seconds * np.arange(1, 2 * count)
    near = 0.01 + 0.02 * seconds
    for k, at in enumerate(turning):
        before = (t < at - near) & (t > (turning[k - 1] + near if k else 0.0))
        assert until[before] == pytest.approx(at - t[before], abs=near)
    assert np.all(np.isinf(until[t > turning[-1] + near]))


def test_turns_are_of_trajectories_alone_and_a_rest_turns_in_its_middle() -> None:
    n = 3 * FEWEST
    assert turns(steps([2.0 * k for k in range(n)], [1.0] * n)).shape == (0,)
    up = [0.1 * k for k in range(21)]
    place = [*up, *[2.0] * 10, *up[::-1]]
    t = [0.01 * k for k in range(len(place))]
    # The second, later, climbs alone: it does not turn, and ends no other's way.
    start = [*t, *[9.0 + 0.01 * k for k in range(FEWEST)]]
    until = turns(steps(start, [*place, *up[:FEWEST]]))
    assert until[:25] == pytest.approx(0.25 - np.array(t[:25]))
    assert np.all(np.isinf(until[26:]))


@pytest.mark.parametrize("step", STEPS)
def test_the_supervisor_tells_the_micro_law_when_its_trajectory_turns(step: Any) -> None:
    control = Control()._with("micro_law", f"{HERE}:foreseeing", "a test")
    p = prepare(control)
    first = supervisor.begin(0.0, p)
    sample = Sample(0.0, 0.0, 2.5, *[math.nan] * 3)
    made = Plan(
        *(np.array(c) for c in ([0.0, 1.0], [1, 1], [1e-3, 1e-3], [1.0, 1.0])), 2.0,
        np.array([1e-3, 0.0]), np.zeros(2),
    )  # fmt: skip
    given = [
        step(p, made._replace(turn=np.array(turn)), first, sample, 1e-3)[2].ctrl
        for turn in ([0.25, 9.0], [math.inf, 0.0], [])
    ]
    assert given == [0.25, 1.0, 1.0]
    assert micro.begin(p.fine)  # a law of one's own had the turn


def plan(velocity: Any, acceleration: Any) -> Plan:
    columns = ([0.0, 1.0], [0, 1], [5.0, 1e-3], [1.0, 1.0])
    made = Plan(*(np.array(c) for c in columns), 2.0)
    return made._replace(velocity=np.array(velocity), acceleration=np.array(acceleration))


@pytest.mark.parametrize("step", STEPS)
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
