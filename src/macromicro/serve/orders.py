"""Requests on their way to the loop: what is always done, and what is void when it comes."""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro.control.live.messages import Refused
from macromicro.serve.requests import ends

_AGAIN = "ask again, if it is still wanted"
OVERTAKEN = Refused("a stop came before it began", _AGAIN)
TOO_LATE = Refused("it came too late: the loop had been held up", _AGAIN)


class Order(NamedTuple):
    """A request, `asked` for at one time and void from another one on (`until`) [ns of the
    monotonic clock]. `trial`: only tell whether it would be refused now."""

    serial: int
    request: Any
    asked: int
    until: int
    trial: bool = False


def void(order: Order, emergency: int, now: int) -> Refused | None:
    """Why nothing is to be done about it `now`, after an emergency stop of the time
    `emergency`; None if it is to be done [ns]."""
    if ends(order.request):
        return None
    if order.asked <= emergency:
        return OVERTAKEN
    return TOO_LATE if now > order.until else None
