"""The token, with a limit on guesses common to all protocols."""

from __future__ import annotations

import hmac
import ipaddress
import math
import threading
import time
from collections import OrderedDict, deque

TRIES, FORGET = 5, 60.0
MOST = 1024  # addresses that are remembered; the one that was wrong longest ago goes first
WRONG = "this is not the token"


class Guesses:
    """Allows `tries` wrong tokens of an address within `forget` seconds."""

    def __init__(self, tries: int = TRIES, forget: float = FORGET) -> None:
        self._tries, self._forget = tries, forget
        self._wrong: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, address: str) -> float:
        """Seconds until a token of this address is checked."""
        times = self._wrong.get(network(address))
        if times is None or len(times) < self._tries:
            return 0.0
        return max(times[0] + self._forget - time.monotonic(), 0.0)

    def wrong(self, address: str) -> None:
        key = network(address)
        times = self._wrong.setdefault(key, deque(maxlen=self._tries))
        times.append(time.monotonic())
        self._wrong.move_to_end(key)
        while len(self._wrong) > MOST:
            self._wrong.popitem(last=False)


class Token:
    """The token that clients must give before they change anything; limits guesses by address."""

    def __init__(self, secret: str | None, guesses: Guesses | None = None) -> None:
        self._secret = secret
        self._guesses = Guesses() if guesses is None else guesses
        self._lock = threading.Lock()

    @property
    def open(self) -> bool:
        return self._secret is None

    def problem(self, given: object, address: str, *, known: bool = False) -> str:
        """Why a client is refused, or ""; compares in constant time."""
        if self._secret is None:
            return ""
        with self._lock:
            wait = 0.0 if known else self._guesses.wait(address)
            if wait > 0.0:
                return f"too many wrong tokens from {address}: wait {math.ceil(wait)} s"
            text = given if isinstance(given, str) else ""
            secret = self._secret.encode("utf-8", "replace")
            if hmac.compare_digest(text.encode("utf-8", "replace"), secret):
                return ""
            self._guesses.wrong(address)
            return WRONG


def network(address: str) -> str:
    """The part of an address that a guesser cannot vary: IPv6 by its first 64 bits."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(found, ipaddress.IPv4Address):
        return str(found)
    return str(found.ipv4_mapped or ipaddress.ip_network((found, 64), strict=False))
