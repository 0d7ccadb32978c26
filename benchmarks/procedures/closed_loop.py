"""Sections 5.3.2 and 6 on the bench: both stages under control, alone and together."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro import api
from macromicro.design.extension import extension, per_cycle
from macromicro.design.vibration import vibration
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.settings import Settings
from procedures.figure import DT, Array, Figure

TRAVEL = 2800
PER_CYCLE = 40
STAIRS = (0.3, 0.8, 1.3, 1.8, 2.3, 2.8, 3.3, 3.8, 3.1, 2.4, 1.7, 1.0, 0.3, 2.0, 3.8, 0.5)


def programme(*moves: tuple[int, float, float]) -> Programme:
    """A programme of (stage, target [counts | mm], hold [s])."""
    stage, target, hold = (np.array(column, dtype=float) for column in zip(*moves, strict=True))
    target = np.where(stage == MICRO, 1e-3 * target, target)
    start = np.full(len(stage), math.nan)
    return Programme("", start, stage.astype(np.int64), target, hold, math.nan, "")


def micro_closed_loop(settings: Settings) -> list[Figure]:
    """Section 5.3.2: steps 0 - 2 - 3 - 2 - 0 mm two seconds apart."""
    levels = (2.0, 3.0, 2.0, 0.0)
    done = api.moves(api.run(programme(*[(MICRO, x, 2.0) for x in levels]), settings=settings))
    time = [math.nan if m.settling_s is None else m.settling_s for m in done]
    up, down = float(np.mean(time[:2])), float(np.mean(time[2:]))
    held = api.moves(api.run(programme(*[(MICRO, x, 2.0) for x in STAIRS]), settings=settings))
    worst = max(abs(m.final_error or 0.0) for m in held)
    return [
        Figure("S13a", "contraction 0-2, 2-3 mm, settling", "0.5 s", 0.3, 0.7, up, "s"),
        Figure("S13b", "extension 3-2, 2-0 mm, settling", "1 s", 0.7, 1.3, down, "s"),
        Figure("S13c", "worst of 16 holds, 0.3-3.8 mm", "5 um", 0.0, 5.0, worst, "um"),
    ]


def macro_closed_loop(settings: Settings) -> list[Figure]:
    """Section 6.4.2: 2800 counts with (4.10)."""
    run = api.run(programme((MACRO, float(TRAVEL), 1.0)), settings=settings)
    error = TRAVEL - run["macro_position"]
    late = float((np.flatnonzero(np.abs(error) > 0.02 * TRAVEL)[-1] + 1) * DT)
    over = max(0.0, float(-error.min()))
    return [
        Figure("M14", "2800 counts to within 2 %", "0.75 s", 0.6, 0.95, late, "s"),
        Figure("M14", "its overshoot", "none", 0.0, 2.0, over, "counts"),
    ]


class Cycles(NamedTuple):
    """Mean return to zero [s] and largest bias by the laser [um], of the first cycle and
    of the last, and the largest true error [um] of the last."""

    first: float
    last: float
    bias_first: float
    bias_last: float
    true_last: float


def cycled(settings: Settings, fan: bool = False, cycles: int = 10) -> Cycles:
    """Section 6.3: the integrated test, over and over."""
    run = api.run("thesis", cycles=cycles, fan=fan, settings=settings)
    done = api.moves(run)
    each = per_cycle(done, extension(run), PER_CYCLE)
    fine = [m for m in done if m.stage == "micro"]
    bias = [max(abs(m.final_error or 0.0) for m in part) for part in (fine[:32], fine[-32:])]
    true = max(abs(m.true_error or 0.0) for m in fine[-32:])
    times = [math.nan if c.extension_s is None else c.extension_s for c in (each[0], each[-1])]
    return Cycles(times[0], times[1], bias[0], bias[1], true)


def integrated(settings: Settings) -> list[Figure]:
    """Sections 6.3 and 6.3.1: ten cycles without a fan and with one."""
    warm, cool = cycled(settings), cycled(settings, fan=True)
    growth = 100.0 * (warm.last / warm.first - 1.0)
    inf = math.inf
    return [
        Figure("I3", "return to zero, cycle 1", "-", -inf, inf, warm.first, "s"),
        Figure("I3", "slower in cycle 10 by", "visibly", 25.0, inf, growth, "%"),
        Figure("I3", "largest bias in cycle 10", "visible", 5.0, inf, warm.bias_last, "um"),
        Figure("I3", "its true error", "-", 0.0, 5.0, warm.true_last, "um"),
        Figure("I4", "return to zero, cycle 10, fan", "1 s", 0.7, 1.3, cool.last, "s"),
        Figure("I4", "largest bias in cycle 10, fan", "none", 0.0, 5.0, cool.bias_last, "um"),
    ]


def shaking(settings: Settings) -> tuple[Array, Array]:
    """Amplitude [um] and decay time [s] after each macro move of the default programme."""
    run = api.run("thesis", settings=settings)
    found = [vibration(run, m) for m in api.moves(run) if m.stage == "macro"]
    known = [v for v in found if v is not None]
    peak = np.array([v.amplitude_um for v in known])
    return peak, np.array([math.nan if v.decay_s is None else v.decay_s for v in known])


def residual_vibration(settings: Settings) -> list[Figure]:
    """Section 6.2: by the laser, a decaying sine fitted."""
    peak, decay = shaking(settings)
    return [
        Figure("I2", "vibration, least of 8 moves", "20 um", 14.0, 26.0, float(peak.min()), "um"),
        Figure("I2", "vibration, greatest", "20 um", 14.0, 26.0, float(peak.max()), "um"),
        Figure("I2", "down to 2 um, quickest", "2 s", 1.5, 2.5, float(decay.min()), "s"),
        Figure("I2", "down to 2 um, slowest", "2 s", 1.5, 2.5, float(decay.max()), "s"),
    ]


def figures(settings: Settings) -> list[Figure]:
    """M14, S13, I2 to I4."""
    return [
        *macro_closed_loop(settings),
        *micro_closed_loop(settings),
        *residual_vibration(settings),
        *integrated(settings),
    ]
