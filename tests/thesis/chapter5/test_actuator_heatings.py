"""Heatings for `identify actuator`: levels and times, each from cold."""

from __future__ import annotations

import numpy as np

from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.thesis.chapter5 import electrothermal_runs as heats


def test_levels_held_steps_stairs_and_bursts() -> None:
    every = heats.actuator_profiles()
    assert len(every) == len(heats.BELOW_STOP) + len(heats.STEPS) + 2
    held = every[: len(heats.BELOW_STOP)]
    assert [(set(c), len(c)) for c in held] == [({v}, 200_000) for v in heats.BELOW_STOP]
    step = every[len(heats.BELOW_STOP)]
    assert set(step[:10_000]) == {heats.STEPS[0]} and set(step[10_000:]) == {0.0}
    assert len(step) == 30_000 and len(every[-2]) == 3000 * len(heats.STAIRS)
    changes = 1 + np.flatnonzero(np.diff(every[-1]))
    assert changes[0] == 350 and every[-1].max() == heats.FULL


def test_long_runs_are_recorded_at_100_hz_others_at_1_khz(monkeypatch) -> None:
    courses = [np.full(60_010, 1.4), np.full(300, 1.8)]
    monkeypatch.setattr(heats, "actuator_profiles", lambda: courses)
    slow, quick = heats.for_actuator(bench.prepare(Bench(), Sensors()), 3)
    assert (slow.dt, len(slow["t"])) == (0.01, 6001) and (quick.dt, len(quick["t"])) == (1e-3, 300)
    assert quick["laser"][-1] > 80.0 and abs(quick["laser"][0]) < 5.0
    assert {"ctrl", "hall_voltage", "contract"} <= {c.name for c in quick.columns}
