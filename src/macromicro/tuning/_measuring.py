"""One controller on the full bench: its recording and its metrics.

The metrics are those of the batch engine, from a rig's sensors. The requested effort is
that of the law without its limit, recomputed from the recorded errors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.batch import macro_bench, micro_bench
from macromicro.lab.drive import closed_loop
from macromicro.nominal import COUNTS, PERIOD
from macromicro.plant import bench
from macromicro.recording import Recording
from macromicro.runs.programmed import on_twin
from macromicro.settings import Settings

STEP = COUNTS  # counts; the whole travel
SECONDS = 10.0
DT = PERIOD


class Shown(NamedTuple):
    metrics: dict[str, float]  # by name, as the batch's jobs have them
    recording: Recording


def macro(settings: Settings) -> Shown:
    """Run a step of 2800 counts from rest at 0, 10 s, under the settings' law."""
    law = macro_bench.law_of(settings)
    plant = bench.prepare(settings.bench, settings.sensors)
    aim = np.full(round(SECONDS / DT), STEP)
    recording = closed_loop(plant, law, aim)
    names = [metric.name for metric in macro_bench.METRICS]
    values = macro_bench.judged(law, STEP, recording["macro_position"], recording["motor"])
    return Shown(dict(zip(names, values, strict=True)), recording)


def micro(settings: Settings, seed: int = 0) -> Shown:
    """Run steps 0 - 2 - 3 - 2 - 0 mm, each held 2 s, on the whole bench with its guard."""
    recording = on_twin(micro_bench.steps(), settings, seed)
    names = [metric.name for metric in micro_bench.METRICS[:-1]]
    if not recording.attributes.get("finished", 1):
        return Shown(dict.fromkeys(names, math.nan), recording)
    return Shown(dict(zip(names, micro_bench.judged(recording, settings), strict=True)), recording)
