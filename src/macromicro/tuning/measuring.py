"""One controller on the full bench: its recording and what is read off it.

The same metrics as the batch engine's, from what a rig's sensors show. The effort asked for
is that of the control law, without its limit, on the recorded errors: laws have no memory
of their own, so a recording replays them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.control import macro as control
from macromicro.control import settings as control_settings
from macromicro.control.macro import MacroLaw
from macromicro.design import steps
from macromicro.design.response import smoothed
from macromicro.kernel import compiled, kernel
from macromicro.nominal import COUNTS, PERIOD
from macromicro.plant import bench
from macromicro.recording import Recording
from macromicro.runs import drives, sequence
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import micro_steps
from macromicro.settings import Settings

Array = npt.NDArray[np.float64]

STEP = COUNTS  # counts; the whole travel
SECONDS = 10.0
DT = PERIOD
HOLD = 2.0  # s
_MEAN = 21  # samples


class Shown(NamedTuple):
    """A run on the bench: `metrics` by name, and its recording."""

    metrics: dict[str, float]
    recording: Recording


def macro(settings: Settings) -> Shown:
    """A step of 2800 counts from rest at 0, 10 s, under the settings' law."""
    law = control_settings.prepare(settings.controller).macro
    plant = bench.prepare(settings.bench, settings.sensors)
    aim = np.full(round(SECONDS / DT), STEP)
    recording = drives.closed_loop(plant, law, aim)
    x, errors = recording["macro_position"], aim - recording["macro_position"]
    asked = np.empty_like(errors)
    compiled(_asked)(law._replace(limit=math.inf), errors, asked, DT)
    size = np.abs(asked[1:])
    return Shown(
        {
            "settling_time": steps.settling_time(x, STEP),
            "rise_time": steps.rise_time(x, STEP),
            "overshoot": steps.overshoot(x, STEP),
            "iae": float(np.abs(errors).sum()) * DT,
            "final_error": float(errors[-1]),
            "peak_effort": float(size.max()),
            "saturated": float(np.count_nonzero(size > law.limit)),
            "reversals": float(len(steps.swings(x, STEP))),
        },
        recording,
    )


@kernel
def _asked(law: MacroLaw, errors: Array, out: Array, dt: float) -> None:
    memory = control.rest(0.0)
    for k in range(len(errors)):
        memory, out[k] = control.step(law, memory, errors[k], dt)


def micro(settings: Settings, seed: int = 0) -> Shown:
    """Steps 0 - 2 - 3 - 2 - 0 mm, each held 2 s, on the whole bench with its guard.

    Settling by the laser into 10 um, means up and down; overshoot beyond each step's target
    and worst error over each hold's last 0.5 s [um]; IAE [mm s]; share of the samples with
    the effort at a limit. All NaN where the guard ended the run.
    """
    programme = micro_steps(sequence.LEVELS, HOLD, sequence.TIMES)
    recording = on_twin(programme, settings, seed)
    names = ("settle_up", "settle_down", "overshoot", "worst_error", "iae", "saturated")
    if not recording.attributes.get("finished", 1):
        return Shown(dict.fromkeys(names, math.nan), recording)
    times = sequence.settling(recording)
    place = smoothed(recording["laser"], _MEAN)
    beyond, left, before = 0.0, 0.0, 0.0
    rows, tail = round(HOLD / DT), round(0.5 / DT)
    for time, level in zip(sequence.TIMES, sequence.LEVELS, strict=True):
        a = round(time / DT)
        error = 1e3 * level - place[a : a + rows]
        beyond = max(beyond, float((-math.copysign(1.0, level - before) * error).max()))
        left = max(left, abs(float(error[-tail:].mean())))
        before = level
    first = round(sequence.TIMES[0] / DT)
    errors = 1e3 * recording["micro_reference"][first:] - place[first:]
    law = control_settings.prepare(settings.controller).micro
    effort = recording["ctrl"][first:]
    full = (effort <= law.low) | (effort >= law.high)
    values = (
        float(np.mean(times[:2])),
        float(np.mean(times[2:])),
        beyond,
        left,
        1e-3 * float(np.abs(errors).sum()) * DT,
        float(full.mean()),
    )
    return Shown(dict(zip(names, values, strict=True)), recording)
