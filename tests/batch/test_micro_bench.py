"""The micro-stage's steps: the numbers that a recording of the same run shows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro import batch
from macromicro.batch import Variants
from macromicro.batch.micro_bench import MicroBenchJob, steps
from macromicro.runs import programmed, sequence
from macromicro.schema.par import replaced
from macromicro.settings import Settings

PATHS = ("controller.pi_antiwindup.kp", "bench.thermal.ambient", "seed")
VALUES = np.array([[3.0, 25.0, 0.0], [2.5, 28.0, 3.0]])


def test_metrics_equal_those_of_a_recording() -> None:
    job = MicroBenchJob()
    found = job.evaluate(Variants(PATHS, VALUES))
    by_name = dict(zip([m.name for m in job.metrics], found[1].tolist(), strict=True))
    settings = Settings()
    for path, value in zip(PATHS[:2], VALUES[1, :2], strict=True):
        settings = replaced(settings, path, float(value))
    what = steps()
    seen = programmed.on_twin(what, settings, int(VALUES[1, 2]))
    times = sequence.settling(seen)
    assert by_name["contraction"] == pytest.approx(np.mean(times[:2]), nan_ok=True)
    assert by_name["extension"] == pytest.approx(np.mean(times[2:]), nan_ok=True)
    done = programmed.moves_of(seen, what, settings)
    # There the laser's mean is over the raw reading, here over the smoothed one.
    assert by_name["worst_error"] == pytest.approx(max(abs(m.final_error) for m in done), abs=0.05)
    low, high = settings.controller.pi_antiwindup[3:]
    effort = seen["ctrl"][1000:]
    assert by_name["saturated"] == np.mean((effort == low) | (effort == high) | (effort == 0.0))
    raw = np.abs(1e3 * seen["micro_reference"] - seen["laser"])[1000:].sum() * 1e-6
    assert by_name["iae"] == pytest.approx(raw, rel=0.02)
    assert by_name["overshoot"] >= 0.0
    assert by_name["fault"] == 0.0


def test_a_run_that_the_guard_stops() -> None:
    row = MicroBenchJob().evaluate(Variants(("guard.hottest",), np.array([[60.0]])))[0]
    assert all(math.isnan(v) for v in row[:-1])
    assert row[-1] > 0.0


def test_threads_change_nothing() -> None:
    job = MicroBenchJob()
    one, two = (
        np.concatenate([m for _, m in batch.run(job, Variants(PATHS, VALUES), n)]) for n in (1, 2)
    )
    assert np.array_equal(one, two, equal_nan=True)
