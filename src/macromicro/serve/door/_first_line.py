"""Recognizes clients of other protocols by their first line, before any of it is executed.

A web page can make a browser send a request to this port and choose part of that line, as in
`GET /;ABOR; HTTP/1.1`; such a connection is refused for good.
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
    """How the first line of a protocol looks."""

    name: str
    leading: re.Pattern[bytes]  # what may precede the first line
    begins: re.Pattern[bytes]  # first byte of the line
    form: re.Pattern[bytes]
    end: re.Pattern[bytes]  # what terminates the line


class ForeignProtocol(Exception):
    """The data belongs to another protocol, which the message names."""


class FirstLine:
    """Holds back data until the first non-blank line can be judged."""

    def __init__(self, grammar: Grammar) -> None:
        self._grammar = grammar
        self._held = bytearray()

    def take(self, data: bytes) -> bytes:
        """The data that may be processed: none yet, or all. Raises `ForeignProtocol`."""
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
