"""Limit and home switches, and the index pulse of an encoder."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.kernel import kernel


class Switch(NamedTuple):
    """A switch along the way; runtime parameters.

    Attributes
    ----------
    there : int
        0: there is none, and it reads 0.
    side : float
        1.0: on at and below its place; -1.0: at and above.
    place : float
        Where it trips, m.
    width : float
        Way over which it is on, m; infinity: to the end.
    hysteresis : float
        Way back until it lets go, m.
    repeatability : float
        Standard deviation of the place where it trips, m.
    """

    there: int
    side: float
    place: float
    width: float
    hysteresis: float
    repeatability: float


class Contact(NamedTuple):
    """State of a switch.

    Attributes
    ----------
    on : float
        0 or 1.
    off : float
        How far from its place it trips this time, m.
    """

    on: float
    off: float


@kernel
def moved(p: Switch, s: Contact, x: float, draw: float) -> Contact:
    """A switch after the load has moved.

    It trips at another place each time, which is drawn when it lets go.

    Parameters
    ----------
    p : Switch
        Parameters.
    s : Contact
        State.
    x : float
        Place of the load now, m.
    draw : float
        Standard normal draw.

    Returns
    -------
    Contact
        New state.
    """
    if p.there == 0:
        return s
    beyond = p.side * (p.place - x) + s.off  # how far it is past the edge
    slack = p.hysteresis if s.on > 0.5 else 0.0
    if -slack <= beyond <= p.width + slack:
        return Contact(1.0, s.off)
    return Contact(0.0, p.repeatability * draw if s.on > 0.5 else s.off)


class Index(NamedTuple):
    """Index pulses of an encoder; runtime parameters.

    Attributes
    ----------
    there : int
        0: there are none.
    place : float
        Where one is, m as the encoder has it.
    spacing : float
        From one to the next, m; 0: there is only one.
    """

    there: int
    place: float
    spacing: float


@kernel
def passed(p: Index, before: float, after: float) -> float:
    """The last index pulse on the way from one place to another.

    Parameters
    ----------
    p : Index
        Parameters.
    before, after : float
        m, as the encoder has it.

    Returns
    -------
    float
        Its place, m; NaN: there is none between them.
    """
    if p.there == 0:
        return math.nan
    if p.spacing == 0.0:
        crossed = (before < p.place) != (after < p.place)
        return p.place if crossed else math.nan
    turn, now = (
        math.floor((before - p.place) / p.spacing),
        math.floor((after - p.place) / p.spacing),
    )
    if turn == now:
        return math.nan
    # Pulses stand at the lower end of their turn: up, that of the last turn; down, the one above.
    return p.place + p.spacing * (now if now > turn else now + 1.0)
