"""Following error against a predicted envelope."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel


class Bounds(NamedTuple):
    """Shape of the envelope, in the unit of the error."""

    margin: Annotated[float, Meaning("above the error at the start")]
    tolerance: Annotated[float, Meaning("always allowed")]
    rate: Annotated[float, Meaning("slowest accepted approach", "1/s")]
    grace: Annotated[float, Meaning("before that approach must have begun", "s")]


class Envelope(NamedTuple):
    reference: Annotated[float, Meaning("the one watched; NaN: none")]
    allowed: Annotated[float, Meaning("error allowed")]
    timer: Annotated[float, Meaning("time since that reference came", "s")]


def no_set_point() -> Envelope:
    """The envelope without a set point."""
    return Envelope(math.nan, 0.0, 0.0)


@kernel
def follow(
    p: Bounds, s: Envelope, active: float, reference: float, error: float, dt: float
) -> Envelope:
    """The envelope one period later; the error is too large above `allowed`.

    A new reference opens it to the present error plus the margin; after the grace it closes at the
    slowest accepted approach, down to the tolerance.
    """
    if active < 0.5:
        return Envelope(math.nan, 0.0, 0.0)
    if reference != s.reference:
        return Envelope(reference, max(error + p.margin, p.tolerance), 0.0)
    if s.timer >= p.grace:
        return Envelope(reference, max(s.allowed - p.rate * dt, p.tolerance), s.timer)
    return Envelope(reference, s.allowed, s.timer + dt)
