"""Where the encoder's edges lie in the laser's frame: a Kalman filter of phase and pitch error.

The edge between counts n - 1 and n, nominally at (n - 1/2) pitch, is seen at that place
+ a + b (n - origin). Resets and drift of the laser, and each crossing, add uncertainty.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.kernel import kernel

GATE = 4.0  # standard errors: beyond it an edge does not belong to the others
OUTLIERS = 5  # of them in a row: counts were lost, or the laser's path is not what it was


class Phase(NamedTuple):
    """Estimate of the edges: two states and their covariance."""

    origin: float  # count at which `a` holds
    a: float  # phase, m
    b: float  # slope, m/count
    aa: float  # variance of `a`, m^2
    ab: float  # covariance, m^2/count
    bb: float  # variance of `b`, m^2/count^2
    number: float  # edges taken
    refused: float  # edges refused in a row


@kernel
def unknown() -> Phase:
    """The missing phase for kernels, which have no None."""
    return Phase(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0)


@kernel
def known(e: Phase) -> bool:
    return e.number >= 0


@kernel
def begin(count: float, a: float, pitch: float, scale: float) -> Phase:
    """The phase before any edge: uniform within half a pitch."""
    slope = scale * pitch
    return Phase(count, a, 0.0, pitch * pitch / 12.0, 0.0, slope * slope, 0.0, 0.0)


@kernel
def at(e: Phase, count: float) -> float:
    """Phase at a count."""
    return e.a + e.b * (count - e.origin)


@kernel
def variance(e: Phase, count: float) -> float:
    """Variance of the phase at a count."""
    d = count - e.origin
    return e.aa + d * (2.0 * e.ab + d * e.bb)


@kernel
def blurred(e: Phase, more: float) -> Phase:
    """The phase after its uncertainty has grown."""
    return Phase(e.origin, e.a, e.b, e.aa + more, e.ab, e.bb, e.number, e.refused)


@kernel
def taken(e: Phase, edge: float, z: float, noise: float) -> Phase:
    """Kalman update by one edge; an outlier is refused and counted."""
    # Kalman's update of x = (a, b) by the reading z = H x + noise, H = (1, d):
    #   error = z - H x, total = H P H' + noise, K = P H' / total, x += K error, P -= K H P.
    # (pa, pb) is P H'. One edge far from the origin thus corrects the slope, and with it home.
    d = edge - e.origin
    pa, pb = e.aa + d * e.ab, e.ab + d * e.bb
    total = pa + d * pb + noise
    error = z - e.a - d * e.b
    if error * error > GATE * GATE * total:
        return Phase(e.origin, e.a, e.b, e.aa, e.ab, e.bb, e.number, e.refused + 1.0)
    ka, kb = pa / total, pb / total
    return Phase(
        e.origin,
        e.a + ka * error,
        e.b + kb * error,
        e.aa - ka * pa,
        e.ab - ka * pb,
        e.bb - kb * pb,
        e.number + 1.0,
        0.0,
    )


@kernel
def sure(e: Phase) -> bool:
    return e.refused < OUTLIERS


@kernel
def error(e: Phase, count: float) -> float:
    """Standard error of the phase at a count."""
    return math.sqrt(max(variance(e, count), 0.0))
