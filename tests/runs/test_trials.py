"""Runs of many machines in threads."""

from __future__ import annotations

from tests.machines.joint.axes import straight

from macromicro.machines import machine, planning
from macromicro.machines.joint import planning as joint_planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.machines.runs import StageSetup
from macromicro.runs.trials import trials

AXIS = machine.MACHINES[0]
USUAL = planning.usual(AXIS.settings)
FIRST = {name: getattr(USUAL, name)[:1] for name in ("start", "stage", "target", "hold")}


def test_threads_change_nothing_and_a_stop_leaves_the_rest_out() -> None:
    setup = StageSetup(AXIS, AXIS.settings, planning.plan(USUAL._replace(**FIRST), AXIS.settings))

    def run(tree: object, seed: int) -> object:
        return setup.with_settings(tree).trial(seed)

    trees = [AXIS.settings.with_("load.payload", f"{k / 10} kg") for k in range(4)]
    one = trials(run, trees, range(4), 1)
    assert one == trials(run, trees, range(4), 3)
    assert len(set(one)) == 4
    assert trials(run, trees, range(4), 2, lambda n: n == 2) == one[:2]
    assert trials(run, [], [], 2) == []


def test_threads_change_nothing_of_two_axes() -> None:
    plan = joint_planning.plan(straight((0.03, 0.02), (0.0, 0.03)), DEFAULT)
    setup = StageSetup(XY_MACHINE, DEFAULT, plan)

    def run(tree: object, seed: int) -> object:
        return setup.with_settings(tree).trial(seed)

    trees = [DEFAULT.with_("y.load.payload", f"{k / 10} kg") for k in range(3)]
    one = trials(run, trees, range(3), 1)
    assert one == trials(run, trees, range(3), 3) and len(set(one)) == 3
