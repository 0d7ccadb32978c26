"""Errors between a client and its machine, with reason and remedy."""

from __future__ import annotations

from typing import Any

from macromicro.errors import MacromicroError
from macromicro.serve import unconfirmed

AGAIN = "ask again if still needed"
_REMEDIES = {
    "stopped": AGAIN,
    "superseded": AGAIN,
    "emergency": "check the machine, enable it, and home it if its position is not trusted",
    "fault": "read the fault, remove its cause, clear it and enable",
    "limit": "stay within the soft limits",
    "stalled": "check what blocks it; home it if its position is not trusted",
    "lost": "check why this client was silent, and take control again",
}


class RequestError(MacromicroError):
    """A request to a machine was not carried out.

    Parameters
    ----------
    reason : str
        Why.
    remedy : str, optional
        Remedy; "" if unknown.

    Examples
    --------
    >>> from macromicro.remote.failures import RequestError
    >>> print(RequestError("no position is known", "home the machine"))
    no position is known; home the machine
    """

    def __init__(self, reason: str, remedy: str = "") -> None:
        super().__init__(f"{reason}; {remedy}" if remedy else reason)
        self.reason, self.remedy = reason, remedy


class RequestRefused(RequestError):
    """The machine refused a request: nothing was changed and nothing moves.

    Parameters
    ----------
    reason : str
        Why.
    remedy : str, optional
        Remedy.
    beyond : bool, optional
        Whether a value is out of range; else the state does not allow the request.

    Examples
    --------
    >>> from macromicro.remote.failures import RequestRefused
    >>> RequestRefused("the target is beyond 200 mm", beyond=True).beyond
    True
    """

    def __init__(self, reason: str, remedy: str = "", *, beyond: bool = False) -> None:
        super().__init__(reason, remedy)
        self.beyond = beyond


class MotionFailed(RequestError):
    """A motion failed.

    Parameters
    ----------
    words : str
        The motion with its target: "move to 12 mm".
    outcome : str
        One of `control.live.messages.OUTCOMES`, never "done".
    place : str
        Where it ended, as a person reads it; "" where that is not known.
    evidence : dict[str, Any]
        Numbers and words by name, the unit in the name.
    remedy : str, optional
        Remedy; by default that of the outcome.

    Examples
    --------
    >>> from macromicro.remote.failures import MotionFailed
    >>> print(MotionFailed("move to 12 mm", "limit", "11.9 mm", {"limit_mm": 11.9}))
    move to 12 mm ended as limit at 11.9 mm; stay within the soft limits
    """

    def __init__(
        self, words: str, outcome: str, place: str, evidence: dict[str, Any], remedy: str = ""
    ) -> None:
        where = f" at {place}" if place else ""
        super().__init__(f"{words} ended as {outcome}{where}", remedy or _REMEDIES.get(outcome, ""))
        self.outcome, self.evidence = outcome, evidence


class ConnectionLost(RequestError):
    """The server does not answer.

    Parameters
    ----------
    reason : str
        Why.
    remedy : str, optional
        Remedy.
    """


class StopNotConfirmed(ConnectionLost):
    """A stop was not confirmed in time: the machine may still move.

    Parameters
    ----------
    what : str
        "Emergency stop" or "Stop".
    reason : str
        Why.

    Examples
    --------
    >>> from macromicro.remote.failures import StopNotConfirmed
    >>> print(StopNotConfirmed("Emergency stop", "the server does not respond"))
    Emergency stop not confirmed: the server does not respond. Cut the power now.
    """

    def __init__(self, what: str, reason: str) -> None:
        super().__init__(unconfirmed.words(what, reason))
        self.reason, self.remedy = f"{what} not confirmed: {reason}", unconfirmed.REMEDY
