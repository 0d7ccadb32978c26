"""One control period: the same bits compiled and interpreted, and one's fault stops all."""

import math

import numpy as np
import pytest

from macromicro import kernel
from macromicro.interpreting import FEW
from macromicro.kernel import compiled, counting
from macromicro.machines import composite, guarding, performing, period, planning, results, runs
from macromicro.machines import machine as machines
from macromicro.machines.joint import contour
from macromicro.machines.joint import planning as joint_planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import AXES, DEFAULT
from tests.machines.joint.axes import linear, ran, straight

AXIS = machines.MACHINES[0]
SLANTED = DEFAULT.with_("hidden.squareness", "1 deg")
SHORT = straight((0.01, 0.004), (0.01, 0.0))


def short(machine):
    """Settings and plan of a short run."""
    if machine is AXIS:
        settings = AXIS.settings
        usual = planning.usual(settings)
        first = (usual.start[:1], usual.stage[:1], usual.target[:1] / 20.0, usual.hold[:1] / 6.0)
        one = usual._replace(start=first[0], stage=first[1], target=first[2], hold=first[3])
        return settings, planning.plan(one, settings)
    return SLANTED, joint_planning.plan(SHORT, SLANTED)


@pytest.mark.parametrize("machine", [AXIS, XY_MACHINE], ids=lambda machine: machine.name)
def test_interpreted_and_compiled_give_the_same_bits(machine):
    settings, planned = short(machine)
    stages, bench = composite.stages(machine), composite.bench(machine, settings)
    loops = performing.loops(machine, settings, planned)
    start = period.beginning(stages, bench, loops)
    draws = np.random.default_rng(1)
    noise = tuple(draws.standard_normal((700, kind.noises)) for kind in stages.kinds)
    blocks, ends = [], []
    for run in (period.period(stages), compiled(period.period(stages))):
        block = np.zeros((len(period.columns(stages)), 700))
        end, written = run(bench, loops, start, noise, block, composite.period(machine, settings))
        assert end.over
        blocks.append(block)
        ends.append(written)
    assert ends[0] == ends[1] and np.array_equal(*blocks)
    looked_at = np.full_like(blocks[0], np.nan)[:, : ends[0]]
    dt = composite.period(machine, settings)
    period.period(stages, recorded=False)(bench, loops, start, noise, looked_at, dt)
    names = [column.name for column in period.columns(stages)]
    efforts = [k for k, name in enumerate(names) if name.endswith("effort")]
    assert np.array_equal(looked_at[efforts], blocks[0][efforts, : ends[0]])
    assert np.isnan(looked_at[names.index("t")]).all()


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("MACROMICRO_CACHE", str(tmp_path))
    kernel._point(kernel._numba())
    yield
    monkeypatch.undo()
    kernel._point(kernel._numba())


@pytest.mark.usefixtures("empty_cache")
def test_few_periods_are_interpreted_until_there_is_machine_code(tmp_path):
    """The first ones of a machine, in whatever run: they are over before it would be compiled."""
    settings, plan = short(AXIS)
    dt, counts = settings.timing.period, []
    stages = composite.stages(AXIS)._replace(names=("first",))
    bench, loops = composite.bench(AXIS, settings), performing.loops(AXIS, settings, plan)
    start = period.beginning(stages, bench, loops)
    noise = (np.random.default_rng(1).standard_normal((300, AXIS.kind.noises)),)
    blocks = []
    with counting(counts.append):
        for expected, compilations in ((FEW - 1000, 0), (1000, 0), (1, 1), (1, 1)):
            block = np.zeros((len(period.columns(stages)), 300))
            period.quickest(stages, expected)(bench, loops, start, noise, block, dt)
            assert bool(counts) == bool(compilations), expected
            blocks.append(block)
    before = len(counts)
    assert all(np.array_equal(block, blocks[0]) for block in blocks)
    (note,) = tmp_path.glob("kernels-*/interpreted/*")
    assert note.read_text() == f"{FEW}"
    note.unlink()
    with counting(counts.append):  # loaded code is used, however few periods there are
        period.quickest(stages, 1)(bench, loops, start, noise, block, dt)
    assert len(counts) == before and not note.exists()


@pytest.mark.parametrize("name", AXES)
def test_an_axis_of_the_pair_is_the_axis_alone(name):
    """With the same plan each axis gives the bits that it gives as a machine of its own."""
    plan, both = ran(SLANTED, straight((0.05, 0.02), (0.01, 0.06)))
    k = AXES.index(name)
    own = (SLANTED.x, SLANTED.y)[k]
    alone = runs.record(AXIS, own, plan.plans[k]).recording
    found = results.alone(both.recording, AXES, name)
    # Alone it does not wait for the other: the first move is compared, until one has arrived.
    n = int(np.argmax(alone["phase"] == 2))
    for column in ("position", "target", "effort", "speed", "integral", "true_position"):
        assert np.array_equal(found[column][:n], alone[column][:n]), column
    assert n > 200


@pytest.mark.parametrize("end", [(0.08, 0.08), (0.1, 0.03), (0.02, 0.15), (0.13, 0.0)])
def test_a_straight_line_stays_straight_on_identical_linear_axes(end):
    settings = linear()
    plan, done = ran(settings, straight(end))
    assert done.outcome.finished
    r = done.recording
    assert np.abs(r["x_target"] - r["x_position"]).max() > 1e-3  # mm: each axis has an error, and
    found = results.of(XY_MACHINE, r, plan, settings)[0].contour
    assert found.peak < 1e-6 and found.true_peak < 1e-6  # mm: it is along the path


def test_unequal_gains_leave_the_line():
    changes = {"y.controller.position": "20 1/s", "y.controller.ahead_velocity": "0 V*s/m"}
    plan, done = ran(linear().with_(changes), straight((0.08, 0.08)))
    r, part = done.recording, results.under_way(done.recording, plan, 0)
    off = contour.contour_error(plan.traces[0], *(1e-3 * r[f"{a}_position"][part] for a in AXES))
    inside = np.all([(r[f"{a}_position"][part] % 80.0) > 2.0 for a in AXES], axis=0)
    ex, ey = (r[f"{a}_target"][part] - r[f"{a}_position"][part] for a in AXES)
    beside = np.abs(ex - ey) / math.sqrt(2.0)  # of both errors only what is across the line
    assert beside[inside].max() > 0.3
    assert 1e3 * off.distance[inside] == pytest.approx(beside[inside], rel=1e-9, abs=1e-12)


def test_both_begin_and_end_together_and_the_next_waits_for_both():
    slow = linear().with_({"y.arrival.tolerance": "0.05 um", "y.controller.position": "15 1/s"})
    plan, done = ran(slow, straight((0.05, 0.05), (0.1, 0.02)))
    r = done.recording
    first = results.rows(r, 0)
    holding = first.start + int(np.argmax(r["phase"][first] == 2))
    for name, own in zip(AXES, (slow.x, slow.y), strict=True):
        error = np.abs(r[f"{name}_target"] - r[f"{name}_position"])[:holding]
        late = error[round(plan.plans[0].length[0] / r.dt) :]
        settled = np.flatnonzero(late > 1e3 * own.arrival.tolerance)
        if name == "y":
            assert len(settled) > 5  # it is what is waited for
        assert np.all(error[-int(own.arrival.dwell / r.dt) + 1 :] <= 1e3 * own.arrival.tolerance)
    moving = [np.flatnonzero(np.diff(r[f"{n}_target"]) != 0.0)[0] for n in AXES]
    assert moving[0] == moving[1]


@pytest.mark.parametrize("name", AXES)
def test_a_fault_of_one_axis_switches_both_off_in_the_same_period(name):
    """A guard that allows less than the move needs trips in the middle of it."""
    settings = DEFAULT.with_({f"{name}.guard.high": "30 mm", f"{name}.travel.high": "29 mm"})
    plan = joint_planning.plan(straight((0.1, 0.1)), DEFAULT)
    done = runs.record(composite.under(XY_MACHINE, settings), settings, plan)
    r, watch = done.recording, done.outcome.watch
    assert watch.fault == guarding.HIGH and watch.time == r["t"][-1]
    assert r["x_effort"][-1] == 0.0 and r["y_effort"][-1] == 0.0
    assert np.all(r["x_effort"][-20:-1] != 0.0) and np.all(r["y_effort"][-20:-1] != 0.0)
    assert r["phase"][-1] == 4 and r["phase"][-2] == 1
    fault = done.outcome.fault
    assert fault.name == "above the soft limit" and fault.message.startswith(f"Axis {name}:")
    assert "both axes" in fault.evidence and not done.outcome.finished


def test_where_the_axes_are_not_square_the_true_place_leans():
    plan, done = ran(SLANTED, straight((0.05, 0.1)))
    r = done.recording
    x, y = r["x_true_position"], r["y_true_position"]
    slant = math.radians(1.0)
    assert r["true_x"] == pytest.approx(x - math.sin(slant) * y, abs=1e-9)
    assert r["true_y"] == pytest.approx(math.cos(slant) * y, abs=1e-9)
    square = ran(DEFAULT, straight((0.05, 0.1)))[1].recording
    assert np.array_equal(square["true_x"], square["x_true_position"])
    for name in ("x_position", "y_position", "x_effort", "y_effort"):  # nobody sees it
        assert np.array_equal(square[name], r[name])
    move = results.of(XY_MACHINE, r, plan, SLANTED)[0]
    assert move.true_error == pytest.approx(100.0 * math.sin(slant), abs=0.1)
    assert move.contour.peak < 0.1 < move.contour.true_peak


def test_a_law_of_ones_own_runs_on_one_axis():
    text = {"y.law": "tests.control.own_laws:sliding"}
    settings = linear().with_(text)
    machine = composite.under(XY_MACHINE, settings)
    (_, first), (_, second) = machine.stages
    assert first.law.name == "cascade" and second.law.name != "cascade"
    names = [c.name for c in performing.columns(machine)]
    assert any(n.startswith("y_law_") for n in names)
    assert not any(n.startswith("x_law_") for n in names)


def test_time_and_sequence_stand_once():
    names = [c.name for c in performing.columns(XY_MACHINE)]
    assert names[:6] == ["t", "phase", "move", "arrived", "true_x", "true_y"]
    assert len(names) == len(set(names))
    rest = [n for n in names[6:] if not n.startswith(("x_", "y_"))]
    assert not rest
