"""A period of each law of the macro-stage, compiled, over readings of its own run."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from macromicro import api
from macromicro.arrays import Array
from macromicro.control import macro, outside
from macromicro.control import settings as control_settings
from macromicro.control.macro import MacroLaw
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.settings import Settings

PROGRAMME = "fast"
MOST = 5.0  # us, for both laws of a period together
REPEATS = 7


@kernel
def replayed(p: MacroLaw, aims: Array, places: Array, dt: float) -> float:
    """Sum of the efforts over readings, so that nothing is left out."""
    memory = macro.begun(p)
    total = 0.0
    for k in range(len(aims)):
        target, sample = Target(aims[k], 0.0, 0.0), Sample(k * dt, places[k])
        memory, effort = macro.step(p, memory, target, sample, dt)
        total += effort
    return total


def lines(timed: Callable[[Callable[[], object], int], float], line: Any) -> list[Any]:
    """One for each law; `timed` and `line` are those of `figures`."""
    found = []
    for name in (*macro.NAMES, *outside.SHIPPED):
        settings = Settings()
        settings = settings._replace(controller=settings.controller.joined(name, "law"))
        run = api.run(PROGRAMME, settings=settings)
        busy = run["phase"] == 1  # the law drives
        aims = np.ascontiguousarray(run["macro_reference"][busy], dtype=float)
        places = np.ascontiguousarray(run["macro_position"][busy], dtype=float)
        p = control_settings.prepare(settings.controller, pitch=settings.sensors.encoder.pitch)
        step = partial(compiled(replayed), p.macro, aims, places, PERIOD)
        spent = timed(step, REPEATS)
        found.append(
            line(f"law {name}", f"at most {MOST:g}", 1e6 * spent / len(aims), "us a period")
        )
    return found
