"""The laser at rest and as feedback (Section 6.4.1): Figure 6.6, claims I5 and I7."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLUE, finish, line, new
from macromicro.experiments import laser_noise
from macromicro.experiments.laser_noise import LaserRuns
from macromicro.experiments.procedure import Lab, Procedure


def collect(lab: Lab) -> LaserRuns:
    """Ten seconds at rest, five times, and holds under control by the laser."""
    return laser_noise.collect(lab.bench(), lab.seed)


def draw(runs: LaserRuns) -> Iterator[Drawn]:
    """Figure 6.6."""
    rest = runs.rest
    rows = slice(0, round(laser_noise.WINDOW_S / rest.dt))
    figure, axes = new(3.2, 1)
    line(axes[0, 0], rest["t"][rows], rest["laser"][rows], BLUE, "laser", linewidth=0.6)
    finish(axes[0, 0], "", y="laser [um]")
    yield Drawn(
        "6.6",
        "Apparent noise of the laser",
        "The laser's reading with the whole system at rest.",
        figure,
        ("I5", "I7"),
    )


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
