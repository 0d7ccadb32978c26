"""Default address, and the addresses and names of the server."""

from __future__ import annotations

import hmac
import ipaddress
import math
import re
import socket
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Sequence
from pathlib import Path

from macromicro.errors import InputError, ProblemError
from macromicro.schema.text import printable

HOST, SCPI_PORT, WEB_PORT = "127.0.0.1", 5025, 8080
STARTING = 4001, "the machine is starting"  # code and reason that close a WebSocket until it has
LEAST_TOKEN = 16  # characters, where others can connect
STRONG = (
    f"at least {LEAST_TOKEN} characters where others can connect, such as what "
    "`openssl rand -hex 16` prints"
)
FOLDER = Path("results/serve")  # of recordings that a client begins
_NAME = re.compile(r"[a-z0-9](?:[a-z0-9.-]{0,251}[a-z0-9])?", re.IGNORECASE)


def require_token(host: str, token: str | None) -> None:
    """Raise InputError for a host open to others that has no strong token."""
    if token is None and not is_loopback(host):
        raise InputError("host", host, "127.0.0.1, or another one together with a token")
    if token is not None and not token.strip():
        raise InputError("token", token, "a text that is hard to guess")
    if token is not None and not is_loopback(host) and len(token.strip()) < LEAST_TOKEN:
        raise ProblemError("token", f"it has {len(token.strip())} characters", f"Give {STRONG}.")


def is_loopback(host: str) -> bool:
    return host == "localhost" or (is_address(host) and ipaddress.ip_address(host).is_loopback)


def names(host: str, given: Sequence[str] = ()) -> tuple[str, ...]:
    """Host names that the page answers to."""
    for name in given:
        if not _NAME.fullmatch(name):
            accepted = "a host name such as bench.lab, without scheme and port"
            raise InputError("--name", printable(name, 300), accepted)
    own = () if is_address(host) else (host,)
    if is_everywhere(host) and _NAME.fullmatch(socket.gethostname()):
        own = (socket.gethostname(),)
    return tuple(dict.fromkeys(name.lower() for name in (*given, *own)))


def reachable_address(host: str, bound: str) -> str:
    """The address at which other computers reach the server."""
    if is_everywhere(host):
        name = socket.gethostname()
        return name.lower() if _NAME.fullmatch(name) else bound
    return bound if is_address(host) or is_loopback(host) else host


def url(host: str, port: int) -> str:
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def is_everywhere(host: str) -> bool:
    """Whether it stands for all addresses of this computer."""
    return is_address(host) and ipaddress.ip_address(host).is_unspecified


def is_address(host: str) -> bool:
    """Whether it is an address, and no name."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


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
