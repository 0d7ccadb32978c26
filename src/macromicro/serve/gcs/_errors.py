"""Error numbers of GCS 2.0 (ERR?) for refusals and failed motions."""

from __future__ import annotations

from macromicro.control.live import messages as m
from macromicro.serve.snapshot import Snapshot

SYNTAX, UNKNOWN, TOO_LONG = 1, 2, 3
NOT_READY = 5  # move without reference or servo off
OUT_OF_LIMITS, STOPPED, NO_AXIS, OUT_OF_RANGE = 7, 10, 15, 17
COUNT, NO_NUMBER, NOT_FOR_STAGE, NOT_REFERENCED = 24, 25, 34, 45
HELD, PASSWORD, NO_TABLE = 51, 56, 57  # 51: another input device has the axis
MOTION = 1024
_STOPS = (m.STOPPED_BY_REQUEST, m.EMERGENCY, m.LOST, m.SUPERSEDED)


class GcsError(Exception):
    """A failed command; `number` as in ERR?."""

    def __init__(self, number: int, detail: str = "") -> None:
        super().__init__(detail or str(number))
        self.number = number


def refusal_error(reply: m.Refused, now: Snapshot, client: str) -> GcsError:
    if reply.beyond:
        number = OUT_OF_LIMITS
    elif not now.running:
        number = MOTION
    else:
        number = HELD if now.holder not in ("", client) else NOT_READY
    return GcsError(number, f"{reply.reason}; {reply.remedy}")


def end_code(outcome: str, *, homing: bool) -> int:
    if outcome in _STOPS:
        return STOPPED
    if homing:
        return NOT_REFERENCED
    return OUT_OF_LIMITS if outcome == m.LIMIT else MOTION
