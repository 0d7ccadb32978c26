"""Connected clients and the holder of control."""

from __future__ import annotations

import time

from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.errors import ProblemError
from macromicro.schema.text import printable


class Holders:
    """Clients by name, of which one at a time holds control."""

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._clients: dict[str, None] = {}
        self._holder = ""
        self._heard = 0.0

    @property
    def holder(self) -> str:
        return self._holder

    @property
    def clients(self) -> tuple[str, ...]:
        return tuple(self._clients)

    def connect(self, client: str) -> None:
        if not client:
            raise ProblemError("client", "the client has no name", "Give it one.")
        self._clients[client] = None

    def disconnect(self, client: str) -> bool:
        """Remove the client; True if it held control."""
        self._clients.pop(client, None)
        held = self._holder == client != ""
        if held:
            self._holder = ""
        return held

    def acquire(self, client: str) -> Reply:
        if not client:
            return Refused("a client without a name cannot hold control", "give it a name")
        if self._holder not in ("", client):
            return Refused(
                f"{printable(self._holder)} holds control",
                "watch, or stop the machine; control is free once that client releases it "
                f"or is silent for {self._timeout:g} s",
            )
        self._clients[client] = None
        self._holder, self._heard = client, time.monotonic()
        return Accepted()

    def release(self, client: str) -> Reply:
        if self._holder != client or not client:
            return _not_held(self._holder)
        self._holder = ""
        return Accepted()

    def refusal(self, client: str) -> Refused | None:
        """Why this client may not command; None if it may, which counts as a heartbeat."""
        if self._holder != client or not client:
            return _not_held(self._holder)
        self._heard = time.monotonic()
        return None

    def heartbeat(self, client: str) -> None:
        if self._holder == client:
            self._heard = time.monotonic()

    def lost(self) -> str:
        """A holder whose timeout has expired, or ""."""
        if not self._holder or time.monotonic() - self._heard <= self._timeout:
            return ""
        lost, self._holder = self._holder, ""
        return lost


def _not_held(holder: str) -> Refused:
    who = f"{printable(holder)} holds it" if holder else "no client does"
    return Refused(f"this client does not hold control ({who})", "acquire control first")
