"""The laser at rest and as feedback (Section 6.4.1): Figure 6.6, claims I5 and I7."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLUE, GREEN, RED, finish, line, new
from macromicro.experiments import laser_noise
from macromicro.experiments.laser_noise import LaserRuns
from macromicro.experiments.procedure import Lab, Procedure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

PRINTED_UM = 2.0


def collect(lab: Lab) -> LaserRuns:
    """Ten seconds at rest, five times, and holds under control by the laser."""
    return laser_noise.collect(lab.bench(), lab.seed)


def draw(runs: LaserRuns) -> Iterator[Drawn]:
    """Figure 6.6: at rest, under control by the laser, and the amplitudes of all records."""
    figure, axes = new(5.6, 2, 2)
    rest = runs.rest
    rows = slice(0, round(laser_noise.WINDOW_S / rest.dt))
    _reading(axes[0, 0], rest["t"][rows], rest["laser"][rows], BLUE, "laser")
    finish(axes[0, 0], "(a) at rest", y="laser [um]", legend=True)
    for ax, name, held, law, colour in (
        (axes[0, 1], "(b)", runs.calmer, laser_noise.CALMER, GREEN),
        (axes[1, 0], "(c)", runs.printed, laser_noise.PRINTED, RED),
    ):
        r = max(held, key=laser_noise.last_window)
        late = slice(-round(laser_noise.WINDOW_S / r.dt), None)
        target = float(r["micro_reference"][-1])
        error = r["laser"][late] - 1e3 * target
        _reading(ax, r["t"][late], error, colour, f"Ki = {law.ki:g}")
        finish(ax, f"{name} held at {target:g} mm", y="laser - target [um]", legend=True)
    parts = np.array_split(rest["laser"], laser_noise.RECORDS)
    _amplitudes(axes[1, 1], runs, [laser_noise.amplitude(part) for part in parts])
    yield Drawn(
        "6.6",
        "Apparent noise of the laser",
        "(a) The laser's reading with the whole system at rest; dashed: ±2 um. (b, c) The noisiest "
        f"of {len(runs.calmer)} holds each with the laser in place of the Hall sensor, last 10 of "
        f"{laser_noise.SETTLE_S + laser_noise.WINDOW_S:g} s: with a third of the integral gain "
        "that the thesis prints, and with all of it, when the loop answers the noise. (d) Half "
        "peak to peak of every record.",
        figure,
        ("I5", "I7"),
    )


def _reading(ax: Axes, t: Array, values: Array, colour: str, label: str) -> None:
    """Readings [um] and the amplitude of 2 um that the thesis prints."""
    line(ax, t, values, colour, label, linewidth=0.6)
    for edge in (-PRINTED_UM, PRINTED_UM):
        ax.axhline(edge, color="0.3", linestyle="--", linewidth=1.0)
    ax.set_ylim(-2.5 * PRINTED_UM, 2.5 * PRINTED_UM)


def _amplitudes(ax: Axes, runs: LaserRuns, rest: list[float]) -> None:
    """Half peak to peak over 10 s of every record: at rest at 0 mm, and over the set points."""
    ax.plot([0.0] * len(rest), rest, color=BLUE, marker="o", ms=4, linestyle="", label="at rest")
    for held, law, colour, marker in (
        (runs.calmer, laser_noise.CALMER, GREEN, "^"),
        (runs.printed, laser_noise.PRINTED, RED, "v"),
    ):
        place = [float(r["micro_reference"][-1]) for r in held]
        size = [laser_noise.last_window(r) for r in held]
        ax.plot(
            place, size, color=colour, marker=marker, ms=4, linestyle="", label=f"Ki = {law.ki:g}"
        )
    ax.axhline(PRINTED_UM, color="0.3", linestyle="--", linewidth=1.0)
    ax.margins(y=0.1)
    ax.set_ylim(bottom=0.0)
    finish(ax, "(d) amplitudes", "set point [mm]", "[um]", legend=True)
    ax.margins(x=0.04)


PROCEDURE = Procedure(
    name="laser-noise",
    title="Noise of the laser",
    sections=("6.4.1", "7"),
    channels=("laser",),
    ids=("I5", "I7"),
    figures=("6.6",),
    diagrams=(),
    seconds=1.0,
    collect=collect,
    claims=laser_noise.claims,
    draw=draw,
)
