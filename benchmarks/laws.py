"""A period of each law of both stages, compiled, over readings of its own run."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from figures import Line, timed

from macromicro import api
from macromicro.arrays import Array
from macromicro.control import macro, micro, outside, supervisor
from macromicro.control import settings as control_settings
from macromicro.control.macro import MacroLaw
from macromicro.control.outside import Kept
from macromicro.control.pi import PiAntiWindup
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.settings import Settings

PROGRAMME = "fast"
MOST = 5.0  # us, for both laws of a period together
REPEATS = 7
MACRO = (*macro.NAMES, *outside.SHIPPED)
MICRO = (*control_settings.MICRO_LAWS, *outside.FINE)
PAIRS = (("pd-tuned", "pi-antiwindup"), ("terminal", "inverse"))


@kernel
def replayed(p: MacroLaw, aims: Array, places: Array, dt: float) -> float:
    """Sum of the efforts over readings, so that nothing is left out."""
    memory = macro.begun(p)
    total = 0.0
    for k in range(len(aims)):
        target, sample = Target(aims[k], 0.0, 0.0, math.inf), Sample(k * dt, places[k])
        memory, effort = macro.step(p, memory, target, sample, dt)
        total += effort
    return total


@kernel
def refined(
    p: PiAntiWindup, own: tuple[Any, ...], kept: Kept, aims: Array, places: Array, dt: float
) -> float:
    """The same of the micro-stage, from a memory that is its own."""
    integral, total = 0.0, 0.0
    for k in range(len(aims)):
        target, sample = Target(aims[k], 0.0, 0.0, math.inf), Sample(k * dt, places[k])
        integral, kept, effort = micro.step(p, own, kept, integral, target, sample, dt)
        total += effort
    return total


def replay(name: str, fine: bool) -> tuple[Callable[[], float], int]:
    """What steps a law over the readings of its turns in a run, and over how many."""
    settings = Settings()
    settings = settings._replace(controller=settings.controller.joined(name, "law"))
    run = api.run(PROGRAMME, settings=settings)
    busy = run["phase"] == (supervisor.MICRO if fine else supervisor.MACRO)
    p = control_settings.prepare(settings.controller, pitch=settings.sensors.encoder.pitch)
    if not fine:
        aims = np.ascontiguousarray(run["macro_reference"][busy], dtype=float)
        places = np.ascontiguousarray(run["macro_position"][busy], dtype=float)
        return partial(compiled(replayed), p.macro, aims, places, PERIOD), len(aims)
    aims = np.ascontiguousarray(1e-3 * run["micro_reference"][busy], dtype=float)
    places = np.ascontiguousarray(1e-3 * run["hall_position"][busy], dtype=float)

    def once() -> float:
        kept = micro.begin(p.fine)  # a law may change its memory in place
        return float(compiled(refined)(p.micro, p.fine, kept, aims, places, PERIOD))

    return once, len(aims)


def lines() -> list[Line]:
    """One for each law, and for each pair both together."""
    spent = {}
    for name in (*MACRO, *MICRO):
        step, periods = replay(name, fine=name in MICRO)
        spent[name] = 1e6 * timed(step, REPEATS) / periods
    found = [Line(f"law {name}", "", us, "us a period") for name, us in spent.items()]
    for pair in PAIRS:
        both = sum(spent[name] for name in pair)
        found.append(Line(f"laws {' and '.join(pair)}", f"at most {MOST:g}", both, "us a period"))
    return found
