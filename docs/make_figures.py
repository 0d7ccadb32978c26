"""Draws docs/figures/integrated-run.png, the README's figure, from a run of the default
programme (the counterpart of Figure 6.2), docs/figures/motion-profile.png, a profile and how the
carriage follows it, docs/figures/xy-path.png, the usual moves of two axes in the plane, and
docs/figures/learning.png, what docs/tuning.md learns.

    python docs/make_figures.py [--quick: draw the profile, write nothing]
"""

from __future__ import annotations

import contextlib
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from macromicro import api
from macromicro.arrays import Array
from macromicro.drawing.files import encode
from macromicro.drawing.style import BLUE, GREEN, ORANGE, finish, new, thin_out
from macromicro.lab import learning
from macromicro.machines import compositions, runs
from macromicro.machines.joint import course, planning
from macromicro.motion import Trajectory, s_curve, trapezoid
from macromicro.programme import Programme, follow, load, travel
from macromicro.recording import Recording
from macromicro.report import joint_figures, learned
from macromicro.runs import programmed
from macromicro.settings import Settings

FIGURES = Path(__file__).resolve().parent / "figures"
PICTURE = FIGURES / "integrated-run.png"
PROFILE = FIGURES / "motion-profile.png"
PATH = FIGURES / "xy-path.png"
PLOTTER = Path(__file__).resolve().parents[1] / "examples" / "machines" / "xy-plotter.toml"
SET_POINT = 32  # the move to 3.0 mm after the seventh macro move
PITCH = 1e3 * Settings().sensors.encoder.pitch


def drawn(ax: Any, t: Array, y: Array, **options: Any) -> None:
    """A column, thinned to about four points a pixel."""
    ax.plot(*thin_out(t, y, 2400), **{"linewidth": 1.5, **options})


def draw(run: Recording) -> Figure:
    """Both stages over the whole programme; below, one set point through the laser."""
    t, move = run["t"], run["move"]
    figure = Figure(figsize=(12.0, 8.0), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, 1, height_ratios=(1.0, 1.0, 1.0))
    coarse = figure.add_subplot(grid[0])
    fine = figure.add_subplot(grid[1], sharex=coarse)
    near = figure.add_subplot(grid[2])
    for ax in (coarse, fine, near):
        ax.grid(True, color="0.88", linewidth=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    dashed: dict[str, Any] = {"color": ORANGE, "linestyle": "--", "linewidth": 1.2}
    drawn(coarse, t, run["macro_position"] * PITCH, color=BLUE, label="encoder")
    drawn(coarse, t, run["macro_reference"] * PITCH, label="reference", **dashed)
    drawn(fine, t, run["hall_position"], color=GREEN, label="Hall sensor")
    drawn(fine, t, run["micro_reference"], label="reference", **dashed)
    a, b = np.searchsorted(move, [SET_POINT, SET_POINT + 1])
    rows = slice(a + 300, b)
    target = 1e3 * float(run["micro_reference"][b - 1])
    near.axhspan(-5.0, 5.0, color=GREEN, alpha=0.13, linewidth=0, label="±5 um")
    drawn(near, t[rows], run["laser"][rows] - target, color=BLUE, label="laser", linewidth=0.7)
    near.axhline(0.0, **dashed)
    near.set_ylim(-25.0, 15.0)
    fine.axvspan(t[a], t[b - 1], color="0.55", alpha=0.25, linewidth=0)
    finish(coarse, "Macro-stage", "", "position [mm]", legend=True)
    finish(fine, "Micro-stage", "time [s]", "contraction [mm]", legend=True)
    place = float(run["macro_reference"][b - 1]) * PITCH
    title = f"The grey set point through the laser: {1e-3 * target:g} mm, carriage at {place:g} mm"
    finish(near, title, "time [s]", "laser - target [um]", legend=True)
    for ax in (coarse, fine, near):
        ax.set_title(ax.get_title(loc="left"), loc="left", fontsize=13)
        ax.tick_params(labelsize=11)
        for label in (ax.xaxis.label, ax.yaxis.label):
            label.set_fontsize(11.5)
        if (legend := ax.get_legend()) is not None:
            for text in legend.get_texts():
                text.set_fontsize(11)
    coarse.tick_params(labelbottom=False)
    figure.align_ylabels([coarse, fine, near])
    figure.subplots_adjust(left=0.07, right=0.985, top=0.95, bottom=0.075, hspace=0.45)
    return figure


def draw_profile() -> Figure:
    """150 mm by an S-curve and by a trapezoid; the carriage on the S-curve."""
    curve, plain = s_curve(0.15, 0.1, 0.5, 4.0), trapezoid(0.15, 0.1, 0.5)
    run = api.run(follow(Trajectory.from_profile(curve), hold=0.3))
    figure, axes = new(4.4, 2, 2, sharex=True)
    t = np.linspace(-0.1, curve.duration + 0.25, 2000)
    for profile, color, name, style in (
        (plain, ORANGE, "trapezoid", "--"), (curve, BLUE, "S-curve", "-"),
    ):  # fmt: skip
        motion = profile.at(t)
        axes[0, 0].plot(t, motion.velocity * 1e3, style, color=color, label=name)
        axes[1, 0].plot(t, motion.acceleration, style, color=color, label=name)
    place, wanted = run["macro_position"] * PITCH, run["macro_reference"] * PITCH
    axes[0, 1].plot(run["t"], place, color=GREEN, label="encoder")
    axes[0, 1].plot(run["t"], wanted, "--", color=BLUE, label="S-curve", linewidth=1.2)
    axes[1, 1].plot(run["t"], wanted - place, color=GREEN, linewidth=0.9)
    finish(axes[0, 0], "The profile", "", "velocity [mm/s]", legend=True)
    finish(axes[1, 0], "", y="acceleration [m/s$^2$]")
    finish(axes[0, 1], "The carriage on it", "", "position [mm]", legend=True)
    finish(axes[1, 1], "", y="error [mm]")
    return figure


def draw_path() -> Figure:
    """The usual moves of the example of two axes, the distance from the path magnified."""
    made, settings = compositions.load(PLOTTER)
    plan = planning.plan(course.usual(settings), settings)
    run = runs.record(made, settings, plan).recording
    return joint_figures.path(run, plan, settings.path.tolerance).figure


def draw_learning() -> None:
    """The page's own wave, learned in ten runs."""
    page = (FIGURES.parent / "tuning.md").read_text(encoding="utf-8")
    settings = Settings()
    settings = settings._replace(controller=settings.controller.joined("inverse", "law"))
    limits = travel.limits(settings.travel, settings.sensors.encoder.pitch)

    def run(what: Programme, k: int) -> Recording:
        return programmed.record(what, settings, seed=k).recording

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        exec(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0])
        wave = load(Path("wave.csv"), limits)
        found = learning.learn(wave, run, learning.sensor_lag(settings), limits)
    learned.draw(found, FIGURES, ("png",))


def main() -> None:
    """Run the default programme, a profile, two axes and a wave, and write the pictures."""
    if "--quick" in sys.argv:
        encode(draw_profile())
        return
    FIGURES.mkdir(parents=True, exist_ok=True)
    PICTURE.write_bytes(encode(draw(api.run())))
    PROFILE.write_bytes(encode(draw_profile()))
    PATH.write_bytes(encode(draw_path()))
    draw_learning()


if __name__ == "__main__":
    main()
