"""Following error against a predicted envelope, not against the raw step."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.kernel import kernel


class Bounds(NamedTuple):
    """The envelope's shape, in the unit of the error.

    Attributes
    ----------
    margin : float
        Above the error at the start.
    tolerance : float
        Always allowed.
    rate : float
        Slowest accepted approach, per s.
    grace : float
        Before that approach must have begun, s.
    """

    margin: float
    tolerance: float
    rate: float
    grace: float


class Envelope(NamedTuple):
    """The envelope at one instant.

    Attributes
    ----------
    reference : float
        The one watched; NaN: none.
    allowed : float
        Error allowed.
    timer : float
        Time since that reference came, s.
    """

    reference: float
    allowed: float
    timer: float


def closed() -> Envelope:
    """The envelope while nothing is being followed.

    Returns
    -------
    Envelope
        Without a reference.
    """
    return Envelope(math.nan, 0.0, 0.0)


@kernel
def follow(
    p: Bounds, s: Envelope, active: float, reference: float, error: float, dt: float
) -> Envelope:
    """The envelope one period later; the error is too large when it exceeds `allowed`.

    A new reference opens it to the present error plus the margin; after the grace it closes at the
    slowest accepted approach, down to the tolerance.

    Parameters
    ----------
    p : Bounds
        Its shape.
    s : Envelope
        Its state.
    active : float
        Whether the stage is under control, 0 or 1.
    reference : float
        Set point.
    error : float
        Size of the following error.
    dt : float
        Control period, s.

    Returns
    -------
    Envelope
        New state.
    """
    if active < 0.5:
        return Envelope(math.nan, 0.0, 0.0)
    if reference != s.reference:
        return Envelope(reference, max(error + p.margin, p.tolerance), 0.0)
    if s.timer >= p.grace:
        return Envelope(reference, max(s.allowed - p.rate * dt, p.tolerance), s.timer)
    return Envelope(reference, s.allowed, s.timer + dt)
