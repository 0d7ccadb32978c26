"""Following error against a predicted envelope, not against the raw step."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.kernel import kernel


class Bounds(NamedTuple):
    """The envelope's shape, in the unit of the error: margin above the error at the
    start, tolerance always allowed, rate [per s] of the slowest accepted approach,
    grace [s] before that approach must have begun."""

    margin: float
    tolerance: float
    rate: float
    grace: float


class Envelope(NamedTuple):
    """Reference watched (NaN: none), error allowed, time since that reference [s]."""

    reference: float
    allowed: float
    timer: float


def closed() -> Envelope:
    """Nothing is being followed."""
    return Envelope(math.nan, 0.0, 0.0)


@kernel
def follow(
    p: Bounds, s: Envelope, active: float, reference: float, error: float, dt: float
) -> Envelope:
    """The envelope one period later; the error is too large when it exceeds `allowed`.

    A new reference opens it to the present error plus the margin; after the grace it
    closes at the slowest accepted approach, down to the tolerance.
    """
    if active < 0.5:
        return Envelope(math.nan, 0.0, 0.0)
    if reference != s.reference:
        return Envelope(reference, max(error + p.margin, p.tolerance), 0.0)
    if s.timer >= p.grace:
        return Envelope(reference, max(s.allowed - p.rate * dt, p.tolerance), s.timer)
    return Envelope(reference, s.allowed, s.timer + dt)
