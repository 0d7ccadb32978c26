"""The thesis' model in lanes: each lane is a single run, bit for bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.control.errors import by_error

from macromicro import batch
from macromicro.batch import Variants, course, lanes
from macromicro.batch.macro_model import MacroLoop, MacroModelJob, single
from macromicro.control import macro as control
from macromicro.design import steps
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.models import macro
from macromicro.models.macro import MacroModelState
from macromicro.schema.par import entries, replaced

DT = 1e-3
RANGES = {
    "controller.now": (0.004, 0.02),
    "controller.before": (-0.018, -0.002),
    "controller.dead_zone": (0.0, 4.0),
    "controller.limit": (3.5, 6.0),
    "model.a": (-0.99, -0.8),
    "model.b": (80.0, 250.0),
    "model.width": (0.0, 4.0),
    "model.a0": (0.0, 1.0),
    "model.delta": (0.2, 1.5),
    "model.limit": (4.0, 6.0),
    "reference": (-3000.0, 3000.0),
}
PATHS = tuple(RANGES)


def sample(n: int, seed: int) -> Variants:
    """`n` variants of everything, no step smaller than 10 counts."""
    rng = np.random.default_rng(seed)
    low, high = np.array(list(RANGES.values())).T
    values = rng.uniform(low, high, (n, len(low)))
    step = values[:, -1]
    values[:, -1] = np.where(rng.random(n) < 0.5, np.rint(step), step)
    values[np.abs(values[:, -1]) < 10.0, -1] = 10.0
    values[::5, 2] = 0.0  # no inverse
    return Variants(PATHS, values)


def tree(variants: Variants, row: int, length: float) -> MacroLoop:
    loop = MacroLoop(length=length)
    for path, value in zip(variants.paths, variants.values[row], strict=True):
        loop = replaced(loop, path, float(value))
    return loop


def from_samples(loop: MacroLoop, x: np.ndarray) -> tuple[float, ...]:
    """The metrics that need no more than the counts of a run, by other means."""
    aim, law = loop.reference, single(loop)[1]
    errors = aim - x
    before = np.concatenate([[0.0], errors[:-1]])
    free = law._replace(limit=math.inf)
    asked = np.abs(
        [
            by_error(free, control.rest(b), e, DT)[1]
            for b, e in zip(before.tolist(), errors.tolist(), strict=True)
        ][1:]
    )
    return (
        steps.settling_time(x, aim),
        steps.rise_time(x, aim),
        steps.overshoot(x, aim),
        float(np.cumsum(np.abs(errors))[-1]) * DT,  # sample by sample, as a run adds them up
        float(errors[-1]),
        float(asked.max()),
        float(np.count_nonzero(asked > law.limit)),
        float(len(steps.swings(x, aim))),
    )


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32), n=st.integers(1, 70))
def test_lanes_equal_single_runs(seed: int, n: int) -> None:
    """Bit for bit, whatever stands in the neighbouring lanes."""
    variants = sample(n, seed)
    found = MacroModelJob(tree=MacroLoop(length=1.5)).evaluate(variants)
    for row in {0, n // 2, n - 1}:
        loop = tree(variants, row, 1.5)
        aim = np.full(1500, loop.reference)
        x, _ = macro.closed_loop(*single(loop), aim, counted=True)
        assert np.array_equal(found[row], from_samples(loop, x), equal_nan=True)


def test_lanes_equal_an_interpreted_run() -> None:
    variants = sample(6, 1)
    found = MacroModelJob(tree=MacroLoop(length=0.8)).evaluate(variants)
    for row in range(6):
        loop = tree(variants, row, 0.8)
        out = np.empty((2, 800))
        aim = np.full(800, loop.reference)
        model, law = single(loop)
        macro.rollout(model, law, MacroModelState(0.0, 0.0), aim, True, out)
        assert np.array_equal(found[row], from_samples(loop, out[0]), equal_nan=True)


def test_interpreted_lanes_equal_compiled_ones() -> None:
    rng = np.random.default_rng(2)
    blocks = []
    for run in (lanes.run, compiled(lanes.run)):
        block = lanes.place()
        rows = block.reshape(lanes.ROWS, lanes.WIDE)
        rng = np.random.default_rng(2)
        rows[:12, :8] = rng.uniform(0.9, 1.1, (12, 8)) * np.array(
            [[e.value] for e in entries(MacroLoop())][:12]
        )
        rows[12:15, :8] = np.array([course.task(float(t)) for t in rows[10, :8]]).T
        run(block, 8, 300)
        blocks.append(rows.copy())
    assert np.array_equal(blocks[0], blocks[1])


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32), n=st.integers(1, 300), threads=st.integers(1, 4))
def test_division_changes_nothing(seed: int, n: int, threads: int) -> None:
    """Pieces of any size over any number of threads: the same bits as one call."""
    variants = sample(n, seed)
    job = MacroModelJob(tree=MacroLoop(length=0.3))
    whole = job.evaluate(variants)
    cut = seed % n
    sets = [Variants(PATHS, variants.values[:cut]), Variants(PATHS, variants.values[cut:])]
    firsts, blocks = zip(*batch.run(job, sets, threads), strict=True)
    assert np.array_equal(np.concatenate(blocks), whole, equal_nan=True)
    assert list(firsts) == np.cumsum([0, *map(len, blocks[:-1])]).tolist()


def test_quick_is_a_part_of_all() -> None:
    variants = sample(20, 5)
    every, quick = MacroModelJob(), MacroModelJob(quick=True)
    assert [m.name for m in quick.metrics] == ["overshoot", "iae", "final_error"]
    assert np.array_equal(every.evaluate(variants)[:, 2:5], quick.evaluate(variants))


def test_several_lengths_and_sample_times() -> None:
    values = np.array([[1e-3, 1.0], [2e-3, 1.0], [1e-3, 0.7], [2e-3, 2.0]])
    together = MacroModelJob().evaluate(Variants(("dt", "length"), values))
    for row, (dt, length) in zip(together, values, strict=True):
        alone = MacroModelJob(tree=MacroLoop(dt=float(dt), length=float(length)))
        assert np.array_equal(row, alone.evaluate(Variants((), np.empty((1, 0))))[0])


def test_the_common_job() -> None:
    """The thesis' tuned loop settles within a second and passes its target by 2 counts at most."""
    row = MacroModelJob().evaluate(Variants((), np.empty((1, 0))))[0]
    found = dict(zip((m.name for m in MacroModelJob().metrics), row, strict=True))
    assert found["overshoot"] <= 2.0
    assert found["rise_time"] <= found["settling_time"] < 1.0
    assert abs(found["final_error"]) <= 1.0


@settings(max_examples=200)
@given(x=st.floats(-(2.0**51), 2.0**51, exclude_min=True, exclude_max=True))
def test_counted_is_whole(x: float) -> None:
    assert lanes.counted(x) == macro.whole(x) == compiled(lanes.counted)(x)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("controller.limit", 0.0, "variant 1, controller.limit"),
        ("model.a", math.nan, "variant 1, model.a"),
        ("model.a", 1.5, "variant 1, model.a"),
        ("reference", 3.0, "variant 1, reference"),
        ("length", 1e-3, "variant 1, length"),
        ("model.z", 1.0, "model.z"),
    ],
)
def test_impossible_values(path: str, value: float, said: str) -> None:
    good = {e.path: e.value for e in entries(MacroLoop())}.get(path, 1.0)
    variants = Variants((path,), np.array([[good], [value]]))
    with pytest.raises(InputError, match=said):
        MacroModelJob().evaluate(variants)


def test_shape_of_the_values() -> None:
    with pytest.raises(InputError, match="shape"):
        MacroModelJob().evaluate(Variants(("model.a",), np.zeros((3, 2))))
    with pytest.raises(InputError, match="each path once"):
        MacroModelJob().evaluate(Variants(("model.a", "model.a"), np.zeros((3, 2))))


def test_trajectories_are_the_single_run_thinned() -> None:
    variants = sample(3, 7)
    job = MacroModelJob(tree=MacroLoop(length=0.5))
    seen = batch.trajectories(job, variants, 7)
    for row in range(3):
        loop = tree(variants, row, 0.5)
        x, motor = macro.closed_loop(*single(loop), np.full(500, loop.reference), counted=True)
        assert np.array_equal(seen.columns["macro_position"][row], x[::7])
        assert np.array_equal(seen.columns["motor"][row], motor[::7])
    assert np.array_equal(seen.t, np.arange(0, 500, 7) * DT)


def test_trajectories_need_one_length() -> None:
    variants = Variants(("length",), np.array([[1.0], [2.0]]))
    with pytest.raises(InputError, match="Give all the same"):
        batch.trajectories(MacroModelJob(), variants)
