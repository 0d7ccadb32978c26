"""Requests on their way to the loop: what is always done, and what is void when it comes."""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused

_AGAIN = "ask again, if it is still wanted"
OVERTAKEN = Refused("a stop came before it began", _AGAIN)
TOO_LATE = Refused("it came too late: the loop had been held up", _AGAIN)

_ALWAYS = (m.Stop, m.EmergencyStop, m.LinkLost, m.Disable)
_WAKES = (m.Enable, m.ClearFault)
_MOTIONS = (m.Home, m.MoveTo, m.MoveBy, m.MoveMacro, m.MoveMicro, m.Programme)


class Order(NamedTuple):
    """A request, `asked` for at one time and void from another one on (`until`) [ns of the
    monotonic clock]. `trial`: only tell whether it would be refused now."""

    serial: int
    request: Any
    asked: int
    until: int
    trial: bool = False


def ends(request: Any) -> bool:
    """Does it end a motion, and nothing else? Such a request is never void."""
    if isinstance(request, m.Jog):
        return isinstance(request.speed, int | float) and request.speed == 0.0
    return isinstance(request, _ALWAYS)


def moves(request: Any) -> bool:
    """Would something move?"""
    return isinstance(request, _MOTIONS) or (isinstance(request, m.Jog) and not ends(request))


def begins(request: Any) -> bool:
    """Would something move, or could it from then on? Behind a stop it would be a surprise."""
    return moves(request) or isinstance(request, _WAKES)


def void(order: Order, emergency: int, now: int) -> Refused | None:
    """Why nothing is to be done about it `now`, after an emergency stop of the time
    `emergency`; None if it is to be done [ns]."""
    if ends(order.request):
        return None
    if order.asked <= emergency:
        return OVERTAKEN
    return TOO_LATE if now > order.until else None
