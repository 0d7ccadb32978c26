"""Measures an earlier calibration again: does it still hold?"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from macromicro.calibration import iso, procedure
from macromicro.calibration.procedure import Request
from macromicro.errors import ProblemError
from macromicro.machines import composite, tree
from macromicro.place import Place

CHANCE = 0.01  # of reporting that a calibration no longer holds which does


class Axis(NamedTuple):
    name: str
    place: Place
    figures: iso.Figures
    promised: float  # half width of the calibration, m
    measured: float  # half width now, m
    limit: float  # greatest half width by chance, m
    holds: bool


class Check(NamedTuple):
    axes: tuple[Axis, ...]
    seed: int


def check(request: Request) -> Check:
    """Measure at positions that no calibration has used, and compare with what it promised."""
    machine, settings = request.machine, request.settings
    for own in machine.trees(settings):
        if not tree.is_corrected(own):
            problem = "the machine has no corrections"
            raise ProblemError("--check", problem, "Calibrate it first (macromicro calibrate).")
    found = procedure.verify(machine, settings, request._replace(seed=request.seed + 17))
    axes = []
    named = zip(
        composite.names(machine), composite.places(machine), machine.trees(settings), strict=True
    )
    for k, (name, place, own) in enumerate(named):
        deviation = found.deviation[:, k]
        promised = float(own.correction.half_width)
        now = procedure.half_width(deviation)
        # What is left is alike in the runs at one position: so many independent values.
        free = 2 * len(np.unique(found.target[:, k]))
        limit = promised * math.sqrt(float(stats.f.ppf(1.0 - CHANCE, free, free)))
        means = iso.means(found.target[:, k], found.direction, deviation)
        figures = iso.figures(means)
        axes.append(Axis(name, place, figures, promised, now, limit, now <= limit))
    return Check(tuple(axes), request.seed)


def text(found: Check) -> str:
    lines = []
    for axis in found.axes:
        whose = f"axis {axis.name}: " if axis.name else ""
        place = axis.place
        now, promised = (
            f"{place.fines * value:.3g} {place.fine}" for value in (axis.measured, axis.promised)
        )
        verdict = "holds" if axis.holds else "no longer holds: calibrate again"
        lines.append(
            f"{whose}the calibration {verdict}: 95 % of positions within {now}, {promised} when it "
            f"was made"
        )
    return "\n".join(lines)


def content(found: Check) -> dict[str, Any]:
    return {
        "axes": [
            {
                "axis": axis.name,
                "holds": axis.holds,
                "unit": axis.place.fine,
                "half_width": axis.place.fines * axis.measured,
                "promised": axis.place.fines * axis.promised,
                "figures": {k: axis.place.fines * v for k, v in axis.figures._asdict().items()},
            }
            for axis in found.axes
        ]
    }
