"""A survey of which everything is known, and what one more sample makes of it."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control.live import edges, survey
from macromicro.control.live.edges import Phase
from macromicro.control.live.parameters import Edges
from macromicro.control.live.survey import NOTHING, Moving, Survey
from macromicro.types import Sample

from .bench import DT, PITCH

NAN = math.nan
Q = Edges()
KNOWN = Phase(3.0, 0.2 * PITCH, 1e-8, 4e-12, -1e-15, 9e-16, 40.0, 1.0)
COUNT, FINE, BASE, OFFSET = 100.0, 0.4e-3, 0.05, 7.0
PLACE = COUNT * PITCH + edges.at(KNOWN, COUNT)  # of the carriage [m], in the midst of a count
WHOLE = PLACE + FINE


def resting(**changed: Any) -> Survey:
    """A carriage at rest, of which everything is known."""
    v = Survey(
        KNOWN, WHOLE - BASE, BASE, 0.0, 0.0, 98.0, COUNT, WHOLE, FINE, PLACE, 0.0, 0.61, 0.0, 3.0,
        99.0, NAN, 0.0, 0.0, 1e-5,
    )  # fmt: skip
    return v._replace(**changed)


def same(v: Survey, other: Survey) -> bool:
    """Up to rounding; variances [m^2] are tiny."""
    phases = [v.phase or edges.unknown(), other.phase or edges.unknown()]
    return phases[0] == pytest.approx(phases[1], rel=1e-9, abs=0.0) and v[1:] == pytest.approx(
        other[1:], rel=1e-9, abs=1e-15, nan_ok=True
    )


def shown(
    v: Survey, q: Edges = Q, *, count: float = COUNT, laser: float = WHOLE - BASE + 1e-8,
    hall: float = 0.7, fine: float = FINE, speed: float = 0.0, standing: float = 0.0,
) -> Survey:  # fmt: skip
    sample = Sample(0.0, count, hall, laser, 1.0, 0.0)
    return survey.followed(q, PITCH, v, sample, Moving(fine, speed, standing, OFFSET), DT)


UNKNOWN = NOTHING._replace(phase=edges.unknown())


def anew(laser: float, periods: int, held: float) -> Survey:
    """Nothing is known but that the laser has said the same for some periods."""
    return UNKNOWN._replace(laser=laser, same=periods, held=held)


def error(e: Phase, count: float) -> float:
    d = count - e.origin
    return math.sqrt(e.aa + 2.0 * d * e.ab + d * d * e.bb)


def blurred(e: Phase, variance: float) -> Phase:
    return e._replace(aa=e.aa + variance)
