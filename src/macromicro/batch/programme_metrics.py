"""Metrics of a programme's run, one number each, from its recording.

The definitions are those of `macromicro run`: settling, errors and overshoot of
`design.response`, vibration of `design.vibration`, return to zero of `design.extension`.
Infinity: a move never settled. NaN: unknown. Of a run that the guard stopped, only the stop,
the missing moves and the heat are known, as its missing moves might have been its worst.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from macromicro.batch.variants import CODE, FAULT, Metric
from macromicro.design.extension import extension
from macromicro.design.response import MoveResult, moves
from macromicro.design.vibration import vibration
from macromicro.programme import MACRO, Programme
from macromicro.recording import Recording
from macromicro.settings import Settings

METRICS: tuple[Metric, ...] = (
    FAULT,
    Metric("macro_missed", "", "macro moves that did not arrive"),
    Metric("micro_missed", "", "micro moves that did not arrive"),
    Metric("macro_settling", "s", "slowest macro move's settling"),
    Metric("macro_overshoot", "count", "largest macro overshoot"),
    Metric("macro_error", "count", "largest final macro error, by the encoder"),
    Metric("contraction", "s", "mean settling of contracting micro moves"),
    Metric("extension", "s", "mean settling of extending micro moves"),
    Metric("micro_error", "um", "largest final micro error, by the laser"),
    Metric("true_micro_error", "um", "largest final micro error, by the bench's truth"),
    Metric("micro_overshoot", "um", "largest micro overshoot, by the laser"),
    Metric("return_to_zero", "s", "slowest return to zero before a macro move"),
    Metric("vibration", "um", "largest vibration after a macro move"),
    Metric("vibration_decay", "s", "longest decay of that vibration to 2 um"),
    Metric("hottest", "degC", "highest wire temperature, by the bench's truth"),
    CODE,
)
NAMES = tuple(m.name for m in METRICS)
# What `measure` reads of a recording.
COLUMNS = (
    *("t", "move", "phase", "macro_position", "laser", "laser_reset", "hall_position"),
    *("true_carriage", "true_micro", "true_wire"),
)
_KNOWN_OF_STOPPED = {"fault", "macro_missed", "micro_missed", "hottest", "fault_code"}


def measure(
    recording: Recording, programme: Programme, settings: Settings, fault: int
) -> NDArray[np.float64]:
    pitch = settings.sensors.encoder.pitch
    done = moves(
        recording, programme, pitch=pitch, macro_band=settings.controller.sequence.tolerance
    )
    coarse = [m for m in done if m.stage == "macro"]
    fine = [m for m in done if m.stage == "micro"]
    up, down = directions(done)
    counts = 1e-3 / pitch
    shaken = [v for m in coarse if (v := vibration(recording, m)) is not None]
    planned = int(np.sum(programme.stage == MACRO))
    values = {
        "fault": float(fault != 0),
        "macro_missed": _count_missed(coarse, planned),
        "micro_missed": _count_missed(fine, len(programme.stage) - planned),
        "macro_settling": max(_settling(coarse), default=math.nan),
        "macro_overshoot": _largest([_times(m.overshoot, counts) for m in coarse]),
        "macro_error": _largest([m.final_error_counts for m in coarse]),
        "contraction": _mean(_settling(up)),
        "extension": _mean(_settling(down)),
        "micro_error": _largest([m.final_error for m in fine]),
        "true_micro_error": _largest([m.true_error for m in fine]),
        "micro_overshoot": _largest([m.overshoot for m in fine]),
        "return_to_zero": max(
            (math.inf if r.time_s is None else r.time_s for r in extension(recording)),
            default=math.nan,
        ),
        "vibration": _largest([v.amplitude_um for v in shaken]),
        "vibration_decay": max(
            (math.inf if v.decay_s is None else v.decay_s for v in shaken), default=math.nan
        ),
        "hottest": float(recording["true_wire"].max()) if len(recording) else math.nan,
        "fault_code": float(fault),
    }
    if fault:
        values |= dict.fromkeys(set(values) - _KNOWN_OF_STOPPED, math.nan)
    return np.array([values[name] for name in NAMES])


def _count_missed(found: Sequence[MoveResult], planned: int) -> float:
    """Number of moves that did not arrive, were not begun or were cut short."""
    return float(planned - sum(m.complete and m.arrived_s is not None for m in found))


def _settling(found: Sequence[MoveResult]) -> list[float]:
    """Each move's settling time [s]; infinite if it did not settle."""
    return [math.inf if m.settling_s is None else m.settling_s for m in found]


def _largest(values: Sequence[float | None]) -> float:
    return max((abs(v) for v in values if v is not None), default=math.nan)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else math.nan


def _times(value: float | None, factor: float) -> float | None:
    # Whole counts stay whole: 1 count in mm and back must not exceed a limit of 1 count.
    return None if value is None else round(value * factor, 9)


def directions(done: list[MoveResult]) -> tuple[list[MoveResult], list[MoveResult]]:
    """Micro moves that contract, and those that extend.

    The direction is from the place before; a macro move resets the micro-stage to 0.
    """
    up: list[MoveResult] = []
    down: list[MoveResult] = []
    before = 0.0
    for move in done:
        if move.stage == "macro":
            before = 0.0
            continue
        if move.target != before:
            (up if move.target > before else down).append(move)
        before = move.target
    return up, down
