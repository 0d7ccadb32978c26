"""Default address, and the addresses and names of the server."""

from __future__ import annotations

import ipaddress
import re
import socket
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


def guarded(host: str, token: str | None) -> None:
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


def reached(host: str, bound: str) -> str:
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
