"""Two rigs on one clock: who waits for whom, and the same moves as simulated compiled."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro.machines import results, rig, runs
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT, of
from macromicro.machines.on_rig import Rigs
from macromicro.report import joint_figures
from macromicro.types import SAFE


def pair(tree: Any) -> Rigs:
    twins = [
        rig.CompiledTwin(axis.kind, own)
        for (_, axis), own in zip(XY_MACHINE.stages, of(tree), strict=True)
    ]
    return Rigs(twins)


def test_alone_either_lets_time_pass_and_in_step_only_the_second() -> None:
    both = pair(DEFAULT)
    first, second = both.members
    dt = DEFAULT.x.timing.period
    first.write(SAFE._replace(motor=5.0))
    for _ in range(100):
        second.wait(dt)
    assert first.now() == second.now() == pytest.approx(100 * dt)
    # The first kept its effort meanwhile, the second had none.
    assert first.read().encoder > 50.0 and second.read().encoder == 0.0
    first.wait(dt)
    both.together = True
    now = first.now()
    first.wait(dt)
    assert first.now() == second.now() == now == pytest.approx(101 * dt)
    second.wait(dt)
    assert first.now() == second.now() == pytest.approx(102 * dt)
    with first:
        first.write(SAFE._replace(motor=5.0))
    assert both.rigs[0]._outputs == SAFE


def test_in_step_the_moves_are_those_of_the_compiled_machine() -> None:
    tree = DEFAULT
    whole = course.usual(tree)
    plan = planning.plan(whole._replace(legs=whole.legs[:2]), tree)
    both = pair(tree)
    both.together = True
    done = runs.record(XY_MACHINE, tree, plan, on=both.members, warn=False)
    there = runs.record(XY_MACHINE, tree, plan)
    assert done.outcome.finished and done.outcome.fault is None
    for name in ("t", "x_position", "y_position", "x_target", "y_target", "move"):
        assert done.recording[name] == pytest.approx(there.recording[name], abs=1e-9), name
    mine, theirs = (results.of(XY_MACHINE, one.recording, plan, tree) for one in (done, there))
    assert [m.arrived_s for m in mine] == [m.arrived_s for m in theirs]
    assert mine[1].contour is not None and theirs[1].contour is not None
    assert mine[1].contour.peak == pytest.approx(theirs[1].contour.peak)
    # Nobody knows where a rig's load truly is, and no picture says it.
    assert np.isnan(mine[1].contour.true_peak) and mine[1].true_error is None
    figure = joint_figures.path(done.recording, plan, tree.path.tolerance).figure
    assert "true" not in figure.axes[0].get_legend_handles_labels()[1]


def test_a_fault_of_one_stops_both() -> None:
    tree = DEFAULT.with_("y.guard.error", "0.1 um")
    plan = planning.plan(course.usual(tree), tree)
    both = pair(tree)
    both.together = True
    done = runs.record(XY_MACHINE, tree, plan, on=both.members, warn=False)
    assert not done.outcome.finished
    fault = done.outcome.fault
    assert fault is not None and fault.message.startswith("Axis y")
    assert done.recording["x_effort"][-1] == done.recording["y_effort"][-1] == 0.0
    assert all(twin._outputs == SAFE for twin in both.rigs)
