"""The macro-stage of the bench: the same numbers as from a recording of the single run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro import batch
from macromicro.batch import Variants, macro_bench
from macromicro.batch.macro_bench import MacroBenchJob
from macromicro.control.settings import Control, prepare
from macromicro.design import steps
from macromicro.errors import InputError
from macromicro.lab import drive
from macromicro.plant import bench
from macromicro.schema.par import replaced
from macromicro.settings import Settings

PATHS = ("bench.friction.coulomb", "controller.pd_tuned.now", "reference")
VALUES = np.array([[10.485, 0.0124593, 2800.0], [9.0, 0.013, 300.0], [11.5, 0.0118, -90.0]])


def single(settings: Settings, target: float, seconds: float) -> tuple[float, ...]:
    plant = bench.prepare(settings.bench, settings.sensors)
    law = prepare(settings.controller).macro
    aim = np.full(round(seconds / 1e-3), target)
    seen = drive.closed_loop(plant, law, aim)
    x = seen["macro_position"]
    errors = aim - x
    return (
        steps.settling_time(x, target),
        steps.rise_time(x, target),
        steps.overshoot(x, target),
        float(np.cumsum(np.abs(errors))[-1]) * 1e-3,
        float(errors[-1]),
        float(len(steps.swings(x, target))),
    )


@pytest.mark.parametrize("law", ["pid", "pd-initial", "pd-tuned"])
def test_metrics_equal_those_of_a_recording(law: str) -> None:
    base = Settings(controller=Control(macro_law=law))
    found = MacroBenchJob(settings=base, length=1.5).evaluate(Variants(PATHS, VALUES))
    for row, values in zip(found, VALUES, strict=True):
        settings = base
        for path, value in zip(PATHS[:2], values[:2], strict=True):
            settings = replaced(settings, path, float(value))
        expected = single(settings, float(values[2]), 1.5)
        assert np.array_equal(row[[0, 1, 2, 3, 4, 7]], expected, equal_nan=True)


def test_effort_beyond_the_limit() -> None:
    """A law of proportional action alone: what it asks for is known without a run."""
    control = Control(macro_law="pid", pid=Control().pid._replace(kp=0.02, ki=0.0, kd=0.0))
    job = MacroBenchJob(settings=Settings(controller=control), length=0.5)
    _, seen = macro_bench.run(job.base(), 2800.0, 500)
    row = job.evaluate(Variants((), np.empty((1, 0))))[0]
    asked = 0.02 * np.abs(2800.0 - seen[0])[1:]
    assert row[5] == asked.max()
    assert row[6] == np.count_nonzero(asked > 5.0) > 0


def test_threads_change_nothing() -> None:
    job = MacroBenchJob(length=0.2)
    one, three = (
        np.concatenate([m for _, m in batch.run(job, Variants(PATHS, VALUES), n)]) for n in (1, 3)
    )
    assert np.array_equal(one, three, equal_nan=True)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("bench.carriage.stop_high", -0.02, "variant 4, bench.carriage.*stop_high"),
        ("bench.carriage.mass", 0.0, "variant 4, bench.carriage.mass"),
        ("bench.steps.macro", 2.5, "variant 4, bench.steps.macro.*whole"),
        ("bench.friction.coulomb", math.inf, "variant 4, bench.friction.coulomb"),
        ("reference", 0.0, "variant 4, reference"),
        ("controller.macro_law", 1.0, "controller.macro_law"),
        ("bench.friction.colour", 1.0, "bench.friction.colour"),
    ],
)
def test_impossible_values(path: str, value: float, said: str) -> None:
    with pytest.raises(InputError, match=said):
        MacroBenchJob(length=0.01).evaluate(Variants((path,), np.array([[value]])), 4)


def test_options() -> None:
    with pytest.raises(InputError, match="length"):
        MacroBenchJob(length=0.0)
    with pytest.raises(InputError, match="reference"):
        MacroBenchJob(reference=5.0)
