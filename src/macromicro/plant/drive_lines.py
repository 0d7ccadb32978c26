"""Enable input and fault output of a drive, which trips by the heat of its current."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.kernel import kernel


class Wiring(NamedTuple):
    """Runtime parameters.

    Attributes
    ----------
    enable : int
        1: it has an enable input; else it is always on.
    rise : float
        From the enable input until it gives current, s.
    fault : int
        1: it has a fault output.
    continuous : float
        Current that never trips it, A.
    slow : float
        Time constant of its heat, s.
    """

    enable: int
    rise: float
    fault: int
    continuous: float
    slow: float


class Drive(NamedTuple):
    """State of the drive.

    Attributes
    ----------
    asked : float
        The enable input, 0 or 1.
    on : float
        For how long, s.
    heat : float
        Share of what trips it.
    fault : float
        0 or 1; stays until the enable input is off and it has cooled.
    """

    asked: float
    on: float
    heat: float
    fault: float


COOL = 0.9  # of the heat that trips it: from there on it can be switched on again


def slow(current: float, continuous: float, peak_time: float) -> float:
    """Time constant of a heat that the greatest current brings to 1 within a time.

    The heat goes with the square of the current: h' = ((i / continuous)^2 - h) / slow.

    Parameters
    ----------
    current : float
        The greatest, A.
    continuous : float
        Below that, A.
    peak_time : float
        s.

    Returns
    -------
    float
        s; infinity for a current that never trips it.
    """
    share = (continuous / current) ** 2
    return -peak_time / math.log(1.0 - share) if share < 1.0 else math.inf


@kernel
def ready(p: Wiring, s: Drive) -> bool:
    """Whether the drive gives current.

    Parameters
    ----------
    p : Wiring
        Parameters.
    s : Drive
        State.

    Returns
    -------
    bool
        False while it is off, rises or has tripped.
    """
    if s.fault > 0.5:
        return False
    return p.enable == 0 or (s.asked > 0.5 and s.on >= p.rise - 1e-9)


@kernel
def advanced(p: Wiring, s: Drive, current: float, dt: float) -> Drive:
    """The drive a control period later.

    Parameters
    ----------
    p : Wiring
        Parameters.
    s : Drive
        State.
    current : float
        In the motor, A.
    dt : float
        Control period, s.

    Returns
    -------
    Drive
        New state.
    """
    on = s.on + dt if s.asked > 0.5 else 0.0
    if p.fault == 0:
        return Drive(s.asked, on, 0.0, 0.0)
    share, rate = current / p.continuous, dt / p.slow
    heat = (s.heat + rate * share * share) / (1.0 + rate)
    fault = s.fault
    if heat >= 1.0:
        fault = 1.0
    elif heat < COOL and (s.asked < 0.5 or p.enable == 0):
        fault = 0.0
    return Drive(s.asked, on, heat, fault)
