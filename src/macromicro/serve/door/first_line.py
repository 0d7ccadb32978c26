"""Clients of other protocols, known by their first line before any of it is done.

Any page that a browser shows can have it send a request to this port, and chooses what stands
behind the request's first line and parts of that line: `GET /;ABOR; HTTP/1.1`. Such a
connection is never one of ours, whatever it sends later; so are those of TLS, SSH, printers and
port scanners.
"""

from __future__ import annotations

import re
from typing import NamedTuple

JUDGED = 1024  # bytes of a first line that are looked at
_VERSION = re.compile(rb"[ \t][A-Z]{3,8}/[0-9][.0-9]*[ \t\r]*$", re.IGNORECASE)  # as of HTTP
_NAMES = (
    (re.compile(rb"\x16\x03"), "TLS"),
    (re.compile(rb"SSH-"), "SSH"),
    (re.compile(rb"\x1b%-12345X|@PJL"), "a printer's language"),
    (re.compile(rb"[^\n]*[ \t]RTSP/", re.IGNORECASE), "RTSP"),
    (re.compile(rb"[^\n]*[ \t]SIP/|[A-Z]+ sips?:", re.IGNORECASE), "SIP"),
    (re.compile(rb"[^\n]*[ \t]HTTP/|[A-Z]+[ \t]+/|[A-Z-]+:[ \t]", re.IGNORECASE), "HTTP"),
)


class Grammar(NamedTuple):
    """How a protocol begins. `name`: of the protocol; `leading`: what may stand before its first
    line; `begins`: that line's first byte; `form`: of the line; `end`: what ends it, by which
    it can be judged."""

    name: str
    leading: re.Pattern[bytes]
    begins: re.Pattern[bytes]
    form: re.Pattern[bytes]
    end: re.Pattern[bytes]


class ForeignProtocol(Exception):
    """What comes is another protocol; the words say what it looks like."""


class FirstLine:
    """Holds back what a client sends until its first line that is not blank can be judged."""

    def __init__(self, grammar: Grammar) -> None:
        self._grammar = grammar
        self._held = bytearray()

    def take(self, data: bytes) -> bytes:
        """What may be heard now: nothing yet, or all that came. Raises `ForeignProtocol`."""
        self._held += data
        leading = self._grammar.leading.match(self._held)
        assert leading is not None  # it matches nothing, too
        del self._held[: leading.end()]
        if not self._held:
            return b""
        if self._grammar.begins.match(self._held) is None:
            raise ForeignProtocol(self._looks())
        end = self._grammar.end.search(self._held, 0, JUDGED)
        if end is None and len(self._held) < JUDGED:
            return b""
        line = bytes(self._held[: JUDGED if end is None else end.start()])
        if self._grammar.form.match(line) is None or _VERSION.search(line) is not None:
            raise ForeignProtocol(self._looks())
        return bytes(self._held)

    def _looks(self) -> str:
        found = (name for pattern, name in _NAMES if pattern.match(self._held[:JUDGED]))
        return next(found, f"no {self._grammar.name}")
