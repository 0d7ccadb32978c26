"""Limit and home switches, and the index pulse of an encoder."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel


class Switch(NamedTuple):
    """A switch along the travel."""

    there: Annotated[int, Meaning("0: there is none, and it reads 0")]
    side: Annotated[float, Meaning("1.0: on at and below its place; -1.0: at and above")]
    place: Annotated[float, Meaning("where it trips", "m")]
    width: Annotated[float, Meaning("distance over which it is on; infinity: to the end", "m")]
    hysteresis: Annotated[float, Meaning("hysteresis", "m")]
    repeatability: Annotated[float, Meaning("standard deviation of the place where it trips", "m")]


class Contact(NamedTuple):
    on: Annotated[float, Meaning("0 or 1")]
    off: Annotated[float, Meaning("how far from its place it trips this time", "m")]


@kernel
def moved(p: Switch, s: Contact, x: float, draw: float) -> Contact:
    """A switch after the load has moved; its trip point is drawn again on release."""
    if p.there == 0:
        return s
    beyond = p.side * (p.place - x) + s.off  # how far it is past the edge
    slack = p.hysteresis if s.on > 0.5 else 0.0
    if -slack <= beyond <= p.width + slack:
        return Contact(1.0, s.off)
    return Contact(0.0, p.repeatability * draw if s.on > 0.5 else s.off)


class Index(NamedTuple):
    there: Annotated[int, Meaning("0: there are none")]
    place: Annotated[float, Meaning("where one is, as the encoder has it", "m")]
    spacing: Annotated[float, Meaning("from one to the next; 0: there is only one", "m")]


@kernel
def passed(p: Index, before: float, after: float) -> float:
    """The last index pulse on the way from one place to another."""
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
