"""The carriage alone: interpreted as compiled, and as the whole bench moves it."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.kernel import compiled
from macromicro.lab import carriage, drive
from macromicro.plant import bench
from macromicro.plant import carriage as physics
from macromicro.settings import Settings

PLANT = bench.prepare(Settings().bench, Settings().sensors)
PART = carriage.MacroBench(PLANT.amplifier, PLANT.macro, PLANT.encoder, PLANT.macro_steps)


@pytest.mark.parametrize("closed", [False, True])
def test_interpreted_equals_compiled(closed: bool) -> None:
    rest = physics.at_rest(0.5 * PART.encoder.pitch)
    outs = np.empty((2, 3, 60))
    given = np.full(60, 50.0 if closed else 4.0)
    for out, run in zip(outs, (carriage.rollout, compiled(carriage.rollout)), strict=True):
        run(PART, drive.law("pd-tuned"), closed, rest, given, out, 1e-3)
    assert np.array_equal(outs[0], outs[1])
    assert np.ptp(outs[0][0]) > 0.0


def test_the_whole_bench_moves_it_alike() -> None:
    volts = np.r_[np.full(200, 4.0), np.full(150, -3.2)]
    alone = drive.open_loop(PLANT, volts, 0.5)
    whole = drive.drive(PLANT, "a push", ("encoder",), np.zeros_like(volts), motor=volts, start=0.0)
    for column, name in (("macro_position", "encoder"), ("motor", "motor"), ("t", "t")):
        np.testing.assert_array_equal(alone[column], whole[name])


def test_effort_beyond_the_limit() -> None:
    law = drive.law("pid")
    run = drive.closed_loop(PLANT, law, np.full(300, 2000.0))
    asked = carriage.unlimited_effort(law, run["macro_reference"], run["macro_position"])
    sent = np.clip(asked, -law.limit, law.limit)
    np.testing.assert_array_equal(sent, run["motor"])
    assert asked.max() > law.limit
