"""Messages for a stop that was not confirmed."""

from __future__ import annotations

from macromicro.control.live.messages import Refused

LOOP, SERVER = "the control loop does not respond", "the server does not respond"
REMEDY = "cut the power now"
EMERGENCY_STOP, STOP = "Emergency stop", "Stop"
SILENT = Refused(LOOP, REMEDY)


def words(what: str, why: str = LOOP) -> str:
    """The whole message for `EMERGENCY_STOP` or `STOP`."""
    return f"{what} not confirmed: {why}. {REMEDY.capitalize()}."
