"""Where the encoder's edges lie in the laser's frame: two numbers, a Kalman filter.

The edge between the counts n - 1 and n nominally lies at (n - 1/2) pitch: a count names its
middle. The laser sees it at that place + a + b (n - origin). `a` is the phase, known to half
a count by the count alone. `b` is the error of `pitch`: a mean over edges near home would be
wrong far away, and one over recent edges would follow the strip and not the laser; with `b`
any edge informs about home, and home stays where it was. The laser's own resets and its drift
make `a` less certain, each edge that is crossed makes both more so.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.kernel import kernel

GATE = 4.0  # standard errors: beyond it an edge does not belong to the others
OUTLIERS = 5  # of them in a row: counts were lost, or the laser's path is not what it was


class Phase(NamedTuple):
    """What is known of the edges: a Kalman filter's two states and their covariance.

    Attributes
    ----------
    origin : float
        Count at which `a` holds.
    a : float
        Phase, m.
    b : float
        Slope, m/count.
    aa : float
        Variance of `a`, m^2.
    ab : float
        Covariance, m^2/count.
    bb : float
        Variance of `b`, m^2/count^2.
    number : int
        Edges taken.
    refused : int
        Edges refused in a row.
    """

    origin: float
    a: float
    b: float
    aa: float
    ab: float
    bb: float
    number: int
    refused: int


@kernel
def unknown() -> Phase:
    """No phase at all, for kernels, which know no None.

    Returns
    -------
    Phase
        Its number is -1.
    """
    return Phase(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1, 0)


@kernel
def known(e: Phase) -> bool:
    """Whether there is a phase.

    Parameters
    ----------
    e : Phase
        Phase.

    Returns
    -------
    bool
        False for `unknown`.
    """
    return e.number >= 0


@kernel
def begin(count: float, a: float, pitch: float, scale: float) -> Phase:
    """The phase while nothing but the present count is known: any within half a pitch is as likely.

    Parameters
    ----------
    count : float
        Present count.
    a : float
        Phase of the count's middle, m.
    pitch : float
        Travel per count, m.
    scale : float
        Standard error of the pitch, as a share of it.

    Returns
    -------
    Phase
        Without edges.
    """
    slope = scale * pitch
    return Phase(count, a, 0.0, pitch * pitch / 12.0, 0.0, slope * slope, 0, 0)


@kernel
def at(e: Phase, count: float) -> float:
    """Phase at a count.

    Parameters
    ----------
    e : Phase
        What is known.
    count : float
        Count at which it is asked, counts.

    Returns
    -------
    float
        m.
    """
    return e.a + e.b * (count - e.origin)


@kernel
def variance(e: Phase, count: float) -> float:
    """Variance of the phase at a count.

    Parameters
    ----------
    e : Phase
        What is known.
    count : float
        Count at which it is asked, counts.

    Returns
    -------
    float
        m^2.
    """
    d = count - e.origin
    return e.aa + d * (2.0 * e.ab + d * e.bb)


@kernel
def blurred(e: Phase, more: float) -> Phase:
    """The phase after it has become less certain.

    Parameters
    ----------
    e : Phase
        What is known.
    more : float
        Variance added, m^2.

    Returns
    -------
    Phase
        What is known then.
    """
    return Phase(e.origin, e.a, e.b, e.aa + more, e.ab, e.bb, e.number, e.refused)


@kernel
def taken(e: Phase, edge: float, z: float, noise: float) -> Phase:
    """One edge more: a Kalman update. One that does not belong to the others is refused and
    counted.

    Parameters
    ----------
    e : Phase
        What is known.
    edge : float
        Count n above it: it lies at (n - 1/2) pitch.
    z : float
        Its phase, m.
    noise : float
        Variance of `z`, m^2.

    Returns
    -------
    Phase
        What is known then.
    """
    # Kalman's update of x = (a, b) by the reading z = H x + noise, H = (1, d):
    #   error = z - H x, total = H P H' + noise, K = P H' / total, x += K error, P -= K H P.
    # (pa, pb) is P H'. One edge far from the origin thus corrects the slope, and with it home.
    d = edge - e.origin
    pa, pb = e.aa + d * e.ab, e.ab + d * e.bb
    total = pa + d * pb + noise
    error = z - e.a - d * e.b
    if error * error > GATE * GATE * total:
        return Phase(e.origin, e.a, e.b, e.aa, e.ab, e.bb, e.number, e.refused + 1)
    ka, kb = pa / total, pb / total
    return Phase(
        e.origin,
        e.a + ka * error,
        e.b + kb * error,
        e.aa - ka * pa,
        e.ab - ka * pb,
        e.bb - kb * pb,
        e.number + 1,
        0,
    )


@kernel
def sure(e: Phase) -> bool:
    """Whether the edges agree with one another.

    Parameters
    ----------
    e : Phase
        What is known.

    Returns
    -------
    bool
        False after `OUTLIERS` refused in a row.
    """
    return e.refused < OUTLIERS


@kernel
def error(e: Phase, count: float) -> float:
    """Standard error of the phase at a count.

    Parameters
    ----------
    e : Phase
        What is known.
    count : float
        Count at which it is asked, counts.

    Returns
    -------
    float
        m.
    """
    return math.sqrt(max(variance(e, count), 0.0))
