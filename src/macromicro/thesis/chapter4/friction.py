"""Friction of the macro-stage (Sections 4.2.1, 4.2.3): Figures 4.4, 4.8 and 4.9, claim M1."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control import deadzone
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, finish, line, new
from macromicro.identify.deadzone import DeadZone
from macromicro.models import macro
from macromicro.recording import Recording
from macromicro.thesis.captions import captioned
from macromicro.thesis.chapter4 import _friction_runs
from macromicro.thesis.chapter4._friction_runs import Coulomb
from macromicro.thesis.claims import DIFFERS, Claim, stated, within
from macromicro.thesis.contents import procedure
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    pass


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
    runs, zone = _friction_runs.probed(plant)
    return FrictionData(
        runs,
        zone,
        _friction_runs.fitted(_friction_runs.pushed(plant)),
        _friction_runs.at_rest(runs),
    )


def claims(data: FrictionData) -> list[Claim]:
    zone = data.zone
    spread = max(float(np.ptp(zone.thresholds(way)[1])) for way in (1, -1))
    verdict = within("M1", zone.width) if spread > 0.0 else DIFFERS
    return [stated("M1", zone.width, verdict, spread=spread)]


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


def evaluated(function: Callable[[float], float], volts: Array) -> Array:
    return np.array([function(float(v)) for v in volts])


def _coulomb(data: FrictionData) -> Drawn:
    found = data.coulomb
    moving, most = found.speeds > 0.0, np.abs(data.held).max(initial=0.0)
    figure, axes = new(3.4, 1, 2)
    ax = axes[0, 0]
    still = np.zeros_like(data.held)
    volts = np.linspace(-5.2, 5.2, 521)
    speed = evaluated(lambda v: found.gain * macro.dead_zone(found.level, v), volts)
    line(ax, volts, speed, BLUE, "Coulomb model")
    _dots(ax, found.volts, found.speeds, "bench, moving", "o")
    _dots(ax, data.held, still, "bench, at rest", "x")
    finish(ax, "(a) steady speed", "voltage [V]", "speed [counts/s]")
    ax.legend(fontsize=7.5, loc="upper left", frameon=False)
    ax = axes[0, 1]
    end = 1.05 * float(np.abs(found.speeds).max())
    model = np.array([-found.level, -found.level, found.level, found.level])
    line(ax, np.array([-end, 0.0, 0.0, end]), model, BLUE, "Coulomb model")
    _dots(ax, found.speeds, found.taken, "bench, moving", "o")
    _dots(ax, still, data.held, "bench, at rest", "x")
    finish(ax, "(b) friction, in volts", "speed [counts/s]", "friction [V]")
    return captioned(
        "4.4",
        figure,
        found=found,
        least=found.taken[moving].min(),
        largest=found.taken[moving].max(),
        most=most,
    )


def _dots(ax: Any, x: Array, y: Array, label: str, marker: str) -> None:
    ax.plot(x, y, color=RED, label=label, marker=marker, markersize=4, linestyle="none")


def _low_voltages(data: FrictionData) -> Drawn:
    zone = data.zone
    best = easiest(zone)
    figure, axes = new(5.6, 2, 2)
    for ax, start, name in ((axes[0, 0], 0.0, "(a)"), (axes[0, 1], best, "(b)")):
        for (volts, r), color in zip(forward(data.runs, start).items(), _COLOURS, strict=True):
            line(ax, r["t"], r["macro_position"], color, f"{volts:g} V")
        finish(ax, f"{name} from {start:.0f} counts", y="position [counts]")
    axes[0, 0].legend(fontsize=7.5, loc="center right", frameon=False)
    stuck = [v for v, r in forward(data.runs, 0.0).items() if r["macro_position"][-1] < 20.0]
    if stuck:
        note = f"up to {max(stuck):g} V: stops within 20 counts"
        axes[0, 0].text(2.45, 90.0, note, fontsize=7.5, horizontalalignment="right")
    _thresholds(axes[1, 0], zone)
    _speeds(axes[1, 1], forward(data.runs, 0.0, MOVING))
    return captioned("4.8", figure, zone=zone)


def _thresholds(ax: Any, zone: DeadZone) -> None:
    for way, color, marker in ((1, BLUE, "o"), (-1, RED, "s")):
        starts, lowest = zone.thresholds(way)
        label = "to greater counts" if way > 0 else "to smaller counts"
        ax.plot(starts, lowest, color=color, marker=marker, markersize=4, linewidth=0.7)
        ax.plot([], [], color=color, marker=marker, markersize=4, label=label)
    ax.axhline(zone.width, color=BLACK, linestyle="--", linewidth=0.9, label="width")
    finish(ax, "(c) lowest voltage that moves on", "start [counts]", "voltage [V]")
    ax.set_ylim(top=zone.width + 0.09)
    ax.legend(fontsize=7.5, loc="upper center", ncols=3, frameon=False)


def speed_by_place(run: Recording) -> tuple[Array, Array]:
    """Place [counts] and speed [counts/s], averaged over `_MEAN` samples, without the ends."""
    x = run["macro_position"]
    begun = round(_friction_runs.BEGUN / run.dt)
    end = int(np.searchsorted(x, _friction_runs.TRAVEL[1]))
    x = x[begun:end]
    return 0.5 * (x[_MEAN:] + x[:-_MEAN]), (x[_MEAN:] - x[:-_MEAN]) / (_MEAN * run.dt)


def _speeds(ax: Any, runs: dict[float, Recording]) -> None:
    for (volts, r), color in zip(runs.items(), (BLUE, GREEN, RED), strict=True):
        line(ax, *speed_by_place(r), color, f"{volts:g} V")
    finish(ax, "(d) speed over place", "place [counts]", "speed [counts/s]")
    ax.set_ylim(bottom=0.0)
    ax.legend(fontsize=7.5, loc="lower center", ncols=3, frameon=False)


def _characteristics(data: FrictionData) -> Drawn:
    width = data.zone.width
    figure, axes = new(3.0, 1, 3)
    end = 2.0 * width
    volts = np.linspace(-end, end, 601)
    # Halves apart: a line across the inverse's step would be drawn where it has no values.
    halves = (volts[volts < 0.0], volts[volts > 0.0])
    zone = evaluated(lambda v: macro.dead_zone(width, v), volts)
    line(axes[0, 0], volts, zone, BLUE, "")
    for part in halves:
        line(axes[0, 1], part, evaluated(lambda v: deadzone.inverse(width, v), part), RED, "")
    axes[0, 1].plot([0.0], [deadzone.inverse(width, 0.0)], color=RED, marker="o", markersize=3)
    both = evaluated(lambda v: macro.dead_zone(width, deadzone.inverse(width, v)), volts)
    line(axes[0, 2], volts, both, GREEN, "")
    finish(axes[0, 0], "(a) dead zone", "in [V]", "out [V]")
    finish(axes[0, 1], "(b) its inverse", "in [V]")
    finish(axes[0, 2], "(c) the inverse, then (a)", "in [V]")
    for ax in axes[0]:
        ax.set_ylim(-1.6 * end, 1.6 * end)
    return captioned("4.9", figure, width=width, left=5.0 - width)


PROCEDURE = procedure(
    "macro-friction",
    {"4.4": _coulomb, "4.8": _low_voltages, "4.9": _characteristics},
    collect,
    claims,
)
