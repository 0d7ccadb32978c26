"""The figures of a run, after Figures 6.2 to 6.5; None where a recording lacks the data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.control.supervisor import MICRO as ENABLED
from macromicro.design import zero
from macromicro.design.response import MICRO_BAND, smoothed
from macromicro.design.tracking import course
from macromicro.drawing.page import PageFigure
from macromicro.drawing.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    finish,
    line,
    new,
    single,
)
from macromicro.programme import MACRO
from macromicro.programme import MICRO as FINE
from macromicro.recording import Recording
from macromicro.report.run import CAPTIONS
from macromicro.runs.job import Ended


def draw(ended: Ended) -> Iterator[PageFigure]:
    if not len(ended.recording):
        return
    for function in (response, tracking, vibration, micro, efforts, temperatures, cycles):
        drawn = function(ended)
        if drawn is not None:
            yield drawn


def fine_laser(recording: Recording) -> Array:
    enabled = (recording["phase"] == ENABLED) & (recording["laser_reset"] == 0)
    return np.where(enabled, zero.contraction(recording), np.nan)


def first_cycle(ended: Ended) -> slice:
    """Rows of the first cycle: the whole run, if there is only one."""
    end = np.searchsorted(ended.recording["move"], ended.job.setup.per_cycle)
    return slice(0, int(end))


def stages(ended: Ended) -> tuple[int, ...]:
    return tuple(s for s in (MACRO, FINE) if np.any(ended.job.programme.stage == s))


def _which(shown: tuple[int, ...]) -> str:
    """The stages in the name of a caption."""
    return "both" if len(shown) > 1 else "macro" if shown[0] == MACRO else "micro"


def response(ended: Ended) -> PageFigure | None:
    """Figure 6.2: the moving stages with their references, a whole cycle and its first moves."""
    if ended.tracking and not ended.moves:
        return None
    recording, pitch = ended.recording, ended.job.settings.sensors.encoder.pitch * 1e3
    t, whole, shown = recording["t"], first_cycle(ended), stages(ended)
    macros = [m for m in ended.moves if m.stage == "macro"]
    until = macros[1].start_s if len(macros) > 1 else min(float(t[-1]), 20.0)
    near = slice(0, max(2, int(np.searchsorted(t, until + 0.5))))
    figure, axes = new(
        5.0 if len(shown) > 1 else 3.0,
        len(shown), 2, sharex="col", gridspec_kw={"width_ratios": [1.7, 1]},
    )  # fmt: skip
    for row, stage in enumerate(shown):
        if stage == MACRO:
            names, scale, sensor = ("macro_reference", "macro_position"), pitch, "encoder"
            color, name, what = BLUE, "macro-stage", "position [mm]"
        else:
            names, scale, sensor = ("micro_reference", "hall_position"), 1.0, "Hall sensor"
            color, name, what = GREEN, "micro-stage", "contraction [mm]"
        for ax, rows in zip(axes[row], (whole, near), strict=True):
            target, place = (recording[n][rows] * scale for n in names)
            line(ax, t[rows], target, ORANGE, "reference", linestyle="--")
            line(ax, t[rows], place, color, sensor)
        last = row == len(shown) - 1
        below = "time [s]" if last else ""
        finish(axes[row, 0], f"(a) {name}" if row == 0 else name, below, what, legend=True)
        finish(axes[row, 1], "(b) the first moves" if row == 0 else "", below)
    several = "the first cycle" if ended.job.request.cycles > 1 else "the whole run"
    return CAPTIONS[f"response of {_which(shown)}"].page("response", figure, several=several)


def tracking(ended: Ended) -> PageFigure | None:
    """A stage on a trajectory: reference and reading, and the error between them."""
    if not ended.tracking:
        return None
    count = len(ended.tracking)
    figure, axes = new(4.2, 2, count, sharex="col", gridspec_kw={"height_ratios": [1.6, 1]})
    pitch = ended.job.settings.sensors.encoder.pitch
    for column, result in enumerate(ended.tracking):
        stage = MACRO if result.stage == "macro" else FINE
        seen = course(ended.recording, ended.job.programme, stage, pitch)
        assert seen is not None
        above, below = axes[:, column]
        line(above, seen.t, seen.reading, BLUE, "encoder" if stage == MACRO else "laser")
        line(above, seen.t, seen.reference, ORANGE, "reference", linestyle="--")
        line(below, seen.t, seen.reference - seen.reading, RED, "", linewidth=0.8)
        finish(above, f"{result.stage}-stage", "", f"position [{result.unit}]", legend=True)
        finish(below, "", y=f"error [{result.unit}]")
    lags = [
        f"the {r.stage}-stage lags by {r.lag_s * 1e3:.0f} ms"
        for r in ended.tracking
        if r.lag_s is not None
    ]
    text = f"; {', '.join(lags)}" if lags else ""
    return CAPTIONS["tracking"].page("tracking", figure, lags=text)


def vibration(ended: Ended) -> PageFigure | None:
    """Figure 6.3: the laser after the first macro move, with the fitted decay."""
    if not ended.vibration:
        return None
    v, recording = ended.vibration[0], ended.recording
    t = recording["t"]
    a = int(np.searchsorted(t, v.rest_s - 0.05))
    b = int(np.searchsorted(recording["move"], v.move + 1))
    resets = np.flatnonzero(recording["laser_reset"][a:b])
    b = a + int(resets[0]) if len(resets) else b
    since = t[a:b] - v.rest_s
    y = recording["laser"][a:b] - v.settled_um
    figure, axes = new(3.3, 1, 2, gridspec_kw={"width_ratios": [1.7, 1]})
    start = max(v.amplitude_um, 1.0)
    for ax, end in zip(axes[0], (since[-1], 0.4), strict=True):
        rows = slice(0, int(np.searchsorted(since, end)))
        line(ax, since[rows], y[rows], BLUE, "laser", linewidth=0.9)
        decay = start * np.exp(-v.decay_rate * np.maximum(since[rows], 0.0))
        line(ax, since[rows], decay, RED, "fitted decay", linestyle="--")
        line(ax, since[rows], -decay, RED, "", linestyle="--")
        ax.axhspan(-2.0, 2.0, color=GREEN, alpha=0.18, linewidth=0, label="±2 um")
        ax.set_ylim(-2.0 * start - 2.0, 2.0 * start + 2.0)
    since_rest = "time since the carriage stands [s]"
    finish(axes[0, 0], "(a) until the laser reset", since_rest, "stage position [um]", legend=True)
    finish(axes[0, 1], "(b) zoom", since_rest)
    decayed = "" if v.decay_s is None else f" It is down to 2 um after {v.decay_s:.2f} s."
    return CAPTIONS["vibration"].page("vibration", figure, v=v, decayed=decayed)


def micro(ended: Ended) -> PageFigure | None:
    """Figures 6.4 and 6.5: the micro-stage in the last cycle, whole and on a set point."""
    fine = [m for m in ended.moves if m.stage == "micro"]
    if not fine:
        return None
    recording, size = ended.recording, ended.job.setup.per_cycle
    t, laser = recording["t"], fine_laser(recording)
    cycle = ended.moves[-1].move // size
    a = int(np.searchsorted(recording["move"], cycle * size))
    zoom = max(([m for m in fine if m.complete] or fine)[-4:], key=lambda m: m.target)
    left, right = (int(np.searchsorted(recording["move"], zoom.move + k)) for k in (0, 1))
    figure, axes = new(3.6, 1, 2, gridspec_kw={"width_ratios": [1.7, 1]})
    whole, near = axes[0]
    line(whole, t[a:], recording["micro_reference"][a:], ORANGE, "reference", linestyle="--")
    line(whole, t[a:], recording["hall_position"][a:], GREEN, "Hall sensor", linewidth=0.8)
    line(whole, t[a:], laser[a:] * 1e-3, BLUE, "laser", linewidth=0.9)
    rows = slice(left, right)
    # Readings pale, their means over 51 ms strong, the laser's broad below the Hall sensor's:
    # neither hides the other, not even where they agree.
    hall = recording["hall_position"][rows] * 1e3 - zoom.target
    for reading, color, name, width in (
        (laser[rows] - zoom.target, BLUE, "laser", 3.0),
        (hall, GREEN, "Hall sensor", 1.0),
    ):
        line(near, t[rows], reading, color, "", linewidth=0.4, alpha=0.3)
        known = np.isfinite(reading)
        mean = smoothed(reading[known], round(0.05 / recording.dt) | 1)
        line(near, t[rows][known], mean, color, name, linewidth=width)
    near.axhline(0.0, color=ORANGE, linestyle="--", linewidth=1.1)
    near.axhspan(-5.0, 5.0, color=BLACK, alpha=0.08, linewidth=0)
    near.set_ylim(-3.0 * MICRO_BAND, 3.0 * MICRO_BAND)
    finish(whole, f"(a) cycle {cycle + 1}", y="contraction [mm]", legend=True)
    words = f"{zoom.target * 1e-3:g} mm; grey: ±5 um"
    near.text(0.98, 0.03, words, fontsize=8, transform=near.transAxes, ha="right")
    finish(near, "(b)", y="reading - target [um]", legend=True)
    return CAPTIONS["micro"].page("micro", figure)


def efforts(ended: Ended) -> PageFigure | None:
    recording, rows, shown = ended.recording, first_cycle(ended), stages(ended)
    t = recording["t"][rows]
    figure, axes = new(3.8 if len(shown) > 1 else 2.2, len(shown), sharex=True)
    for ax, stage in zip(axes[:, 0], shown, strict=True):
        name, color = ("motor", BLUE) if stage == MACRO else ("CTRL", RED)
        line(ax, t, recording[name.lower()][rows], color, name, linewidth=0.8)
        below = "time [s]" if stage == shown[-1] else ""
        finish(ax, name, below, "D/A output [V]")
    several = " in the first cycle" if ended.job.request.cycles > 1 else ""
    return CAPTIONS[f"efforts of {_which(shown)}"].page("efforts", figure, several=several)


def temperatures(ended: Ended) -> PageFigure | None:
    if FINE not in stages(ended):
        return None
    recording = ended.recording
    t = recording["t"]
    figure, ax = single(3.3)
    kinds = (
        ("true_wire", RED, "wire (bench truth)", 0.8),
        ("temperature_estimate", PURPLE, "wire (guard's estimate)", 0.6),
        ("true_plates", BLUE, "plates (bench truth)", 1.2),
        ("true_body", BLACK, "body (bench truth)", 1.6),
    )
    for name, color, label, width in kinds:
        if name in recording:
            line(ax, t, recording[name], color, label, linewidth=width)
    finish(ax, "", y="temperature [degC]", legend=True)
    return CAPTIONS["temperatures"].page("temperatures", figure)


def cycles(ended: Ended) -> PageFigure | None:
    if len(ended.cycles) < 2:
        return None
    number = [c.cycle for c in ended.cycles]
    figure, axes = new(3.3, 1, 2)
    times, biases = axes[0]
    for ax, name, color, marker, label in (
        (times, "extension_s", BLUE, "o", "mean of the cycle"),
        (times, "slowest_s", RED, "^", "slowest of the cycle"),
        (biases, "bias_um", BLUE, "o", "laser"),
        (biases, "left_um", RED, "^", "left at the laser's reset"),
        (biases, "true_bias_um", GREEN, "s", "bench truth"),
    ):
        values = np.array([getattr(c, name) for c in ended.cycles], float)  # None becomes NaN
        if np.isfinite(values).any():
            ax.plot(number, values, marker + "-", color=color, ms=4, linewidth=1, label=label)
    key: Any = {"legend": "best", "frameon": True, "framealpha": 0.8}
    finish(times, "return to zero, to within 20 um", "cycle", "time [s]", **key)
    finish(biases, "bias at the set points", "cycle", "target - reading [um]", **key)
    for ax in axes[0]:
        ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
        ax.xaxis.get_major_locator().set_params(integer=True)
    return CAPTIONS["cycles"].page("cycles", figure)
