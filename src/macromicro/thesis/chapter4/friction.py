"""Friction of the macro-stage (Sections 4.2.1, 4.2.3): Figures 4.4, 4.8 and 4.9, claim M1."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control import deadzone
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    dots,
    finish,
    line,
    new,
)
from macromicro.errors import InputError, ProblemError
from macromicro.identify.deadzone import DeadZone, dead_zone
from macromicro.lab.drive import DT, open_loop
from macromicro.lab.machine import Machine
from macromicro.models import macro
from macromicro.recording import Recording
from macromicro.thesis.claims import DIFFERS, Claim, state, within
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

TRAVEL = (0.0, 2800.0)
VOLTAGES = tuple(float(v) for v in np.round(np.arange(2.6, 3.301, 0.05), 2))
STARTS = tuple(float(x) for x in range(0, 2601, 200))
SECONDS = 2.5
HIGHEST, STEP, MORE = 4.5, 0.05, 6  # V, V, further voltages at a time

# Volts, and seconds in which the carriage stays within its travel at the thesis' speeds.
PUSHES = {3.1: 1.3, 3.25: 1.0, 3.5: 0.8, 4.0: 0.6, 4.5: 0.5, 5.0: 0.4}
START = 20.0  # counts, from the end it leaves
BEGUN = 0.15  # s, six time constants of the drive
PULSES = (3.3, 3.6, 4.0, 4.4, 4.8, 5.0)  # V
REST_MS = 100
# What a pulse may take the carriage, about: a quarter of its travel [counts] at the thesis'
# speeds, 1700 counts/s at 3.1 V and 3977 counts/s at 4 V.
_WAY = 700.0
_GAIN, _ZONE = 2530.0, 2.43


def probing_runs(
    plant: Machine, voltages: Sequence[float] = VOLTAGES, starts: Sequence[float] = STARTS
) -> list[Recording]:
    """A run at each voltage [V], in both directions, from each start [counts, from its own end]."""
    runs = []
    for v in voltages:
        for x in starts:
            runs += _both_ways(plant, v, SECONDS, x)
    return runs


def _both_ways(plant: Machine, volts: float, seconds: float, start: float) -> list[Recording]:
    """A constant voltage in both directions, from `start` [counts] off the end it leaves."""
    steps = np.full(round(seconds / DT), volts)
    # Half a count in, so that the encoder does not stand on an edge.
    places = (start + 0.5, TRAVEL[1] - start + 0.5)
    return [open_loop(plant, way * steps, x) for way, x in zip((1.0, -1.0), places, strict=True)]


def probe(plant: Machine) -> tuple[list[Recording], DeadZone]:
    """The whole procedure (M1): its runs and the dead zone from them.

    Where the carriage still stops at the highest of `VOLTAGES`, higher ones are tried, up to
    4.5 V. If it stops there, too, the dead zone is an `InputError`.
    """
    runs, top = probing_runs(plant), VOLTAGES[-1]
    while True:
        try:
            return runs, dead_zone(runs, travel=TRAVEL)
        except InputError:
            if top >= HIGHEST:
                raise
        further = [round(top + STEP * (k + 1), 2) for k in range(MORE)]
        runs += probing_runs(plant, further)
        top = further[-1]


def measure(plant: Machine) -> DeadZone:
    return probe(plant)[1]


class Coulomb(NamedTuple):
    """Coulomb level and gain of both directions."""

    level: float  # F [V]
    gain: float  # G [counts/s/V]
    volts: Array  # signed steady states [V]
    speeds: Array  # signed steady states [counts/s]

    @property
    def taken(self) -> Array:
        """Friction [V] in each steady state: V - v / G."""
        return self.volts - self.speeds / self.gain


def push(plant: Machine) -> list[Recording]:
    """A run at each voltage of `PUSHES` in both directions, each from its own end."""
    return [run for v, seconds in PUSHES.items() for run in _both_ways(plant, v, seconds, START)]


def steady(run: Recording) -> tuple[float, float]:
    """Volts and steady speed [counts/s] of a run: the slope after `BEGUN`, within the travel."""
    x = run["macro_position"]
    # From the first sample beyond the travel on, the end stop has the carriage.
    gone = np.flatnonzero((x < TRAVEL[0]) | (x > TRAVEL[1]))
    rows = slice(round(BEGUN / run.dt), int(gone[0]) if len(gone) else len(x))
    if len(x[rows]) < 2:
        found = f"{run['motor'][0]:g} V, at the end of the travel within {BEGUN} s"
        raise ProblemError("steady speed", f"{found}", "Lengthen the travel.")
    return float(run["motor"][0]), float(np.polyfit(run["t"][rows], x[rows], 1)[0])


def fit(runs: Sequence[Recording]) -> Coulomb:
    """F and G by least squares over the runs' steady states, |V| = F + |v| / G."""
    volts, speeds = np.array([steady(r) for r in runs]).T
    slope, level = np.polyfit(np.abs(speeds), np.abs(volts), 1)
    return Coulomb(float(level), 1.0 / float(slope), volts, speeds)


def at_rest(runs: Sequence[Recording], seconds: float = 0.5) -> Array:
    """Ascending volts [V] at which some run stood still for its last `seconds`."""
    held = set()
    for r in runs:
        x = r["macro_position"][-round(seconds / r.dt) :]
        if not np.ptp(x) and TRAVEL[0] < x[-1] < TRAVEL[1]:
            held.add(float(r["motor"][-1]))
    return np.array(sorted(held))


def pulses() -> Array:
    """Volts [one value per ms]: each level forth and back, with rests between; all of it twice."""
    rest = np.zeros(REST_MS)
    parts = [rest]
    for volts in PULSES * 2:
        held = round(min(1e3 * _WAY / (_GAIN * (volts - _ZONE)), 250.0))
        parts += [np.full(held, volts), rest, np.full(held, -volts), rest]
    return np.concatenate(parts)


def pulse(plant: Machine) -> Recording:
    """One record from rest in the middle of the travel: columns t, macro_position and motor."""
    return open_loop(plant, pulses(), 0.5 * sum(TRAVEL) + 0.5)


SHOWN = (2.6, 2.8, 2.85, 2.9, 3.0, 3.2)  # V, panels (a) and (b) of Figure 4.8, and (d)
MOVING = (3.0, 3.1, 3.2)
_MEAN = 40  # samples
_COLOURS = (BLACK, PURPLE, ORANGE, GREEN, BLUE, RED)


class FrictionData(NamedTuple):
    runs: list[Recording]
    zone: DeadZone
    coulomb: Coulomb
    held: Array  # [V], at which the carriage stood


def collect(lab: Lab) -> FrictionData:
    plant = lab.bench()
    runs, zone = probe(plant)
    return FrictionData(runs, zone, fit(push(plant)), at_rest(runs))


def claims(data: FrictionData) -> list[Claim]:
    zone = data.zone
    spread = max(float(np.ptp(zone.thresholds(way)[1])) for way in (1, -1))
    verdict = within("M1", zone.width) if spread > 0.0 else DIFFERS
    return [state("M1", zone.width, verdict, spread=spread)]


def easiest(zone: DeadZone) -> float:
    """The start [counts] from which the lowest voltage moves on in the positive direction."""
    starts, lowest = zone.thresholds(1)
    return float(starts[np.nanargmin(lowest)])


def forward(
    runs: list[Recording], start: float, levels: tuple[float, ...] = SHOWN
) -> dict[float, Recording]:
    """For each voltage of `levels` the run that begins nearest to `start` [counts]."""
    found = {}
    for volts in levels:
        here = [r for r in runs if abs(r["motor"][0] - volts) < 1e-9]
        found[volts] = min(here, key=lambda r: abs(float(r["macro_position"][0]) - start))
    return found


def evaluate(function: Callable[[float], float], volts: Array) -> Array:
    return np.array([function(float(v)) for v in volts])


def coulomb(data: FrictionData) -> Drawn:
    found = data.coulomb
    moving, most = found.speeds > 0.0, np.abs(data.held).max(initial=0.0)
    figure, axes = new(3.4, 1, 2)
    ax, taken = axes[0]
    still = np.zeros_like(data.held)
    volts = np.linspace(-5.2, 5.2, 521)
    speed = evaluate(lambda v: found.gain * macro.dead_zone(found.level, v), volts)
    line(ax, volts, speed, BLUE, "Coulomb model")
    _dots(ax, found.volts, found.speeds, "bench, moving", "o")
    _dots(ax, data.held, still, "bench, at rest", "x")
    finish(ax, "(a) steady speed", "voltage [V]", "speed [counts/s]", legend="upper left")
    end = 1.05 * float(np.abs(found.speeds).max())
    model = np.array([-found.level, -found.level, found.level, found.level])
    line(taken, np.array([-end, 0.0, 0.0, end]), model, BLUE, "Coulomb model")
    _dots(taken, found.speeds, found.taken, "bench, moving", "o")
    _dots(taken, still, data.held, "bench, at rest", "x")
    finish(taken, "(b) friction, in volts", "speed [counts/s]", "friction [V]")
    return caption(
        "4.4",
        figure,
        found=found,
        least=found.taken[moving].min(),
        largest=found.taken[moving].max(),
        most=most,
    )


def _dots(ax: Any, x: Array, y: Array, label: str, marker: str) -> None:
    dots(ax, x, y, RED, marker, label, markersize=4)


def low_voltages(data: FrictionData) -> Drawn:
    zone = data.zone
    best = easiest(zone)
    figure, axes = new(5.6, 2, 2)
    for ax, start, name in ((axes[0, 0], 0.0, "(a)"), (axes[0, 1], best, "(b)")):
        for (volts, r), color in zip(forward(data.runs, start).items(), _COLOURS, strict=True):
            line(ax, r["t"], r["macro_position"], color, f"{volts:g} V")
        key = "center right" if ax is axes[0, 0] else False
        finish(ax, f"{name} from {start:.0f} counts", y="position [counts]", legend=key)
    stuck = [v for v, r in forward(data.runs, 0.0).items() if r["macro_position"][-1] < 20.0]
    if stuck:
        note = f"up to {max(stuck):g} V: stops within 20 counts"
        axes[0, 0].text(2.45, 90.0, note, fontsize=7.5, horizontalalignment="right")
    _thresholds(axes[1, 0], zone)
    _speeds(axes[1, 1], forward(data.runs, 0.0, MOVING))
    return caption("4.8", figure, zone=zone)


def _thresholds(ax: Any, zone: DeadZone) -> None:
    for way, color, marker in ((1, BLUE, "o"), (-1, RED, "s")):
        starts, lowest = zone.thresholds(way)
        label = "to greater counts" if way > 0 else "to smaller counts"
        ax.plot(starts, lowest, color=color, marker=marker, ms=4, linewidth=0.7, label=label)
    ax.axhline(zone.width, color=BLACK, linestyle="--", linewidth=0.9, label="width")
    title = "(c) lowest voltage that moves on"
    finish(ax, title, "start [counts]", "voltage [V]", legend="upper center", ncols=3)
    ax.set_ylim(top=zone.width + 0.09)


def speed_by_place(run: Recording) -> tuple[Array, Array]:
    """Place [counts] and speed [counts/s], averaged over `_MEAN` samples, without the ends."""
    x = run["macro_position"]
    begun = round(BEGUN / run.dt)
    end = int(np.searchsorted(x, TRAVEL[1]))
    x = x[begun:end]
    return 0.5 * (x[_MEAN:] + x[:-_MEAN]), (x[_MEAN:] - x[:-_MEAN]) / (_MEAN * run.dt)


def _speeds(ax: Any, runs: dict[float, Recording]) -> None:
    for (volts, r), color in zip(runs.items(), (BLUE, GREEN, RED), strict=True):
        line(ax, *speed_by_place(r), color, f"{volts:g} V")
    labels = ("place [counts]", "speed [counts/s]")
    finish(ax, "(d) speed over place", *labels, legend="lower center", ncols=3)
    ax.set_ylim(bottom=0.0)


def characteristics(data: FrictionData) -> Drawn:
    width = data.zone.width
    figure, axes = new(3.0, 1, 3)
    end = 2.0 * width
    volts = np.linspace(-end, end, 601)
    zone, inverse, whole = axes[0]
    line(zone, volts, evaluate(lambda v: macro.dead_zone(width, v), volts), BLUE, "")
    # Halves apart: a line across the inverse's step would be drawn where it has no values.
    for part in (volts[volts < 0.0], volts[volts > 0.0]):
        line(inverse, part, evaluate(lambda v: deadzone.inverse(width, v), part), RED, "")
    inverse.plot([0.0], [deadzone.inverse(width, 0.0)], color=RED, marker="o", markersize=3)
    both = evaluate(lambda v: macro.dead_zone(width, deadzone.inverse(width, v)), volts)
    line(whole, volts, both, GREEN, "")
    finish(zone, "(a) dead zone", "in [V]", "out [V]")
    finish(inverse, "(b) its inverse", "in [V]")
    finish(whole, "(c) the inverse, then (a)", "in [V]")
    for ax in axes[0]:
        ax.set_ylim(-1.6 * end, 1.6 * end)
    return caption("4.9", figure, width=width, left=5.0 - width)
