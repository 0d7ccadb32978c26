"""A state that is given to a run is left as it is: a second run from it is the same."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.arrays import own
from macromicro.machines import composite, machine, performing, period, planning, stage
from macromicro.plant import bench as plants
from macromicro.rig.twin import CompiledTwin, Twin
from macromicro.settings import Settings
from macromicro.types import SAFE

WIDE = stage.Bounds(-1.0, 10.0, 1e9)


def leaves(state):
    """Every number of a state."""
    if isinstance(state, tuple):
        return [x for part in state for x in leaves(part)]
    return np.ravel(state).tolist()


@pytest.mark.parametrize("one", machine.MACHINES, ids=lambda one: one.name)
def test_a_drive_from_a_state_can_be_repeated(one):
    tree = one.settings
    params, dt = one.kind.prepare(tree), tree.timing.period
    full = 0.5 * tree.guard.effort
    warm = stage.drive(one.kind, params, np.full(300, full), WIDE, dt).state
    before = leaves(warm)
    efforts = full * np.sin(np.linspace(0.0, 9.0, 400)) ** 2
    first, second = (stage.drive(one.kind, params, efforts, WIDE, dt, state=warm) for _ in range(2))
    assert np.array_equal(first.position, second.position) and np.ptp(first.position) > 0.0
    assert leaves(warm) == before


@pytest.mark.parametrize("one", machine.MACHINES, ids=lambda one: one.name)
def test_a_run_from_a_state_can_be_repeated(one):
    tree, kind = one.settings, one.kind
    plan = planning.plan(planning.usual(tree), tree)
    stages, bench = composite.stages(one), composite.bench(one, tree)
    control = performing.loops(one, tree, plan)
    began = period.beginning(stages, bench, control)
    fastest, n = period.fastest(stages), 400
    noise = (np.zeros((n, kind.noises)),)

    def go(state):
        out = np.empty((len(period.columns(stages)), n))
        after, written = fastest(bench, control, state, noise, out, tree.timing.period)
        return after, out[:, :written]

    middle, _ = go(began)
    before = leaves(middle)
    (_, first), (_, second) = go(middle), go(middle)
    assert np.array_equal(first, second, equal_nan=True)
    assert np.array_equal(leaves(middle), before, equal_nan=True)


@pytest.mark.parametrize("kind", [Twin, CompiledTwin])
def test_two_twins_of_the_two_stage_machine_share_no_state(kind):
    plant = plants.prepare(Settings().bench, Settings().sensors)
    state = plants.initial(plant)
    before = leaves(state)

    def heated():
        twin = kind(plant, 0, state=state)
        for _ in range(400):
            twin.read()
            twin.write(SAFE._replace(ctrl=2.0))
            twin.advance()
        return twin.read().hall

    assert heated() == heated()
    assert leaves(state) == before


def test_a_copy_has_arrays_of_its_own():
    state = (1.0, (np.zeros(2), "a"))
    copy = own(state)
    copy[1][0][0] = 1.0
    assert state[1][0][0] == 0.0 and copy[1][1] == "a"
