"""Who is connected, and which one of them holds control."""

from __future__ import annotations

import threading
import time

from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.errors import InputError
from macromicro.schema.text import printable


class Holders:
    """Clients by name; at most one holds control. Thread-safe.

    `timeout` [s]: silence of the holder after which it counts as lost.
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._lock = threading.Lock()
        self._clients: dict[str, None] = {}
        self._holder = ""
        self._heard = 0.0

    @property
    def holder(self) -> str:
        """The client that holds control, or ""."""
        return self._holder

    @property
    def clients(self) -> tuple[str, ...]:
        """All that are connected, in the order in which they came."""
        with self._lock:
            return tuple(self._clients)

    def connect(self, client: str) -> None:
        """A client that watches. Raises InputError for one without a name."""
        if not client:
            raise InputError("client", client, "a name")
        with self._lock:
            self._clients[client] = None

    def disconnect(self, client: str) -> bool:
        """The client is gone; True if it held control, which is free now."""
        with self._lock:
            self._clients.pop(client, None)
            held = self._holder == client != ""
            if held:
                self._holder = ""
            return held

    def acquire(self, client: str) -> Reply:
        """Control for the client, if no other one holds it."""
        if not client:
            return Refused("a client without a name cannot hold control", "give it a name")
        with self._lock:
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
        """Control is free again."""
        with self._lock:
            if self._holder != client or not client:
                return _not_held(self._holder)
            self._holder = ""
            return Accepted()

    def refusal(self, client: str) -> Refused | None:
        """Why this client may not give orders; None if it may, which is a sign of life."""
        with self._lock:
            if self._holder != client or not client:
                return _not_held(self._holder)
            self._heard = time.monotonic()
            return None

    def heartbeat(self, client: str) -> None:
        """A sign of life; only the holder's counts."""
        with self._lock:
            if self._holder == client:
                self._heard = time.monotonic()

    def lost(self) -> str:
        """A holder that has been silent for too long, whose control is free now, or ""."""
        with self._lock:
            if not self._holder or time.monotonic() - self._heard <= self._timeout:
                return ""
            lost, self._holder = self._holder, ""
            return lost


def _not_held(holder: str) -> Refused:
    who = f"{printable(holder)} holds it" if holder else "nobody does"
    return Refused(f"this client does not hold control ({who})", "acquire control first")
