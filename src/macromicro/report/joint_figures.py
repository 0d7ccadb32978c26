"""Figures of a run of several stages: the path with magnified errors, and all over time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.page import PageFigure
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, RED, finish, line, new, single
from macromicro.machines import composite, results
from macromicro.machines.composite import Composite, names
from macromicro.machines.joint import contour
from macromicro.machines.joint.settings import AXES
from macromicro.machines.planning import Schedule
from macromicro.machines.stage_trees import all_of
from macromicro.recording import Recording
from macromicro.report.run import CAPTIONS

SHOWN = 0.05  # of the picture's width; what the largest contour error is magnified to
_COLORS = (BLUE, ORANGE, GREEN, RED)


def magnification(peak: float, span: float) -> float:
    """A round factor that makes an error visible in a picture."""
    if not peak > 0.0:
        return 1.0
    wanted = SHOWN * span / peak
    power = 10.0 ** math.floor(math.log10(max(wanted, 1.0)))
    return max(power * max(k for k in (1.0, 2.0, 5.0) if k * power <= max(wanted, 1.0)), 1.0)


def _ways(recording: Recording) -> list[tuple[str, str, str, str]]:
    """Columns, colour and name of the drawn positions; the true ones if known."""
    every = [
        ("true_x", "true_y", RED, "true"),
        ("x_position", "y_position", BLUE, "by the encoders"),
    ]
    known = (way for way in every if way[0] in recording)
    return [way for way in known if not np.isnan(recording[way[0]]).all()]


def _nearest_points(recording: Recording, plan: Schedule, names: tuple[str, str]) -> Iterator[Any]:
    """Rows, positions (mm) and nearest points of each move on a path, during its profile."""
    for k in np.unique(recording["move"][recording["move"] >= 0]).tolist():
        if plan.traces[k].pieces:
            part = results.under_way(recording, plan, k)
            x, y = (results.fill_gaps(recording[name][part]) for name in names)
            yield part, x, y, contour.contour_error(plan.traces[k], 1e-3 * x, 1e-3 * y)


def path(recording: Recording, plan: Schedule, tolerance: float) -> PageFigure:
    """The path in the plane, with the encoders' and the true positions."""
    ways = _ways(recording)
    found = {way[3]: list(_nearest_points(recording, plan, way[:2])) for way in ways}
    every = [each for parts in found.values() for each in parts]
    peak = max((float(np.max(each[3].distance)) for each in every), default=0.0)
    width = max(float(np.ptp(recording[f"{name}_target"])) for name in AXES) * 1e-3
    factor = magnification(peak, max(width, 1e-9))
    figure, ax = single(7.6)
    for *_, color, label in ways:
        for number, (_, x, y, near) in enumerate(found[label]):
            px, py = 1e3 * near.x, 1e3 * near.y
            ax.plot(
                px + factor * (x - px),
                py + factor * (y - py),
                color=color,
                linewidth=0.9,
                label=label if number == 0 else "",
            )
    for number, trace in enumerate(t for t in plan.traces if t.pieces):
        x, y = outline(trace)
        label = "path" if number == 0 else ""
        ax.plot(1e3 * x, 1e3 * y, color=BLACK, linewidth=0.8, linestyle="--", label=label)
    ax.set_aspect("equal", adjustable="datalim")
    ticks = f"{factor:,.0f}".replace(",", " ")
    finish(ax, f"Distance from the path, {ticks} times as large", "x [mm]", "y [mm]", legend=True)
    return CAPTIONS["path"].page(
        "path", figure, ticks=ticks, tolerance=1e6 * tolerance, magnified=1e3 * factor * tolerance
    )


def outline(trace: Any) -> tuple[Array, Array]:
    """Points of a path, on arcs one each 0.02 rad."""
    xs, ys = [], []
    for piece in trace.pieces:
        n = math.ceil(abs(piece.curvature) * piece.length / 0.02) + 2
        x, y = piece.at(np.linspace(0.0, piece.length, n))
        xs.append(x)
        ys.append(y)
    return np.concatenate(xs), np.concatenate(ys)


def axes_over_time(
    recording: Recording, plan: Schedule, machine: Composite, settings: Any
) -> PageFigure:
    """Positions, errors and efforts of each stage over the run; in a plane the contour error."""
    plane = machine.has_plane
    figure, grid = new(9.4, 4 if plane else 3, sharex=True)
    places, errors, *paths, efforts = grid[:, 0]
    t = recording["t"]
    units = composite.places(machine)
    trees = machine.trees(settings)
    same = len(set(units)) == 1
    for k, (name, own, place) in enumerate(zip(names(machine), trees, units, strict=True)):
        color = _COLORS[k % len(_COLORS)]
        target, position = recording[f"{name}_target"], recording[f"{name}_position"]
        label = name if same else f"{name} [{place.unit}]"
        line(places, t, target, BLACK, "", linewidth=0.8, linestyle="--")
        line(places, t, position, color, label)
        label = name if same else f"{name} [{place.fine}]"
        line(errors, t, 1e3 * (target - position), color, label)
        for edge in (-own.arrival.tolerance, own.arrival.tolerance):
            errors.axhline(place.fines * edge, color=color, linewidth=0.8, linestyle=":")
        line(efforts, t, recording[f"{name}_effort"], color, name)
    unit, fine = (f"[{units[0].unit}]", f"[{units[0].fine}]") if same else ("", "")
    finish(places, "Position; dashed: set point", "", unit, legend=True)
    finish(errors, "Set point minus position; dotted: tolerance", "", fine, legend=not same)
    if plane:
        _paths(paths[0], recording, plan, settings.path.tolerance)
    finish(efforts, "Effort at the D/A", y="[V]", legend=True)
    figure.subplots_adjust(hspace=0.3)
    found = CAPTIONS["axes of a plane" if plane else "axes"].page("axes", figure)
    return found._replace(title=all_of(len(units)).capitalize())


def _paths(ax: Any, recording: Recording, plan: Schedule, tolerance: float) -> None:
    """The distance from the path over time, while a profile lasts."""
    t = recording["t"]
    for *columns, color, label in _ways(recording):
        far = np.full(len(t), np.nan)
        for part, _, _, near in _nearest_points(recording, plan, (columns[0], columns[1])):
            far[part] = 1e6 * near.distance
        line(ax, t, far, color, label)
    ax.axhline(1e6 * tolerance, color=GREEN, linewidth=0.8, linestyle=":")
    title = "Distance from the path while the profile lasts; dotted: tolerance"
    finish(ax, title, "", "[um]", legend=True)
