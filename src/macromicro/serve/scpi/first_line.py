"""Clients of other protocols, known by their first line before any of it is done.

Any page that a browser shows can have it send a request to this port, and chooses what stands
behind the request's first line and parts of that line: `GET /;ABOR; HTTP/1.1`. Such a
connection is never SCPI, whatever it sends later; so are those of TLS, SSH, printers and
port scanners.
"""

from __future__ import annotations

import re

JUDGED = 1024  # bytes of a first line that are looked at
_LEADING = re.compile(rb"[ \t\r\n;]*")
_BEGINS = re.compile(rb"[*:A-Za-z]")
# The form of a line's first command: a header, and behind white space the beginning of a
# number, a string, a block, or a word that ends as words do.
_FORM = re.compile(
    rb"""(?:\*[A-Z]+|:?[A-Z]\w*(?::[A-Z]\w*)*)\??
    (?: [ \t\r]*(?:;|$) | [ \t\r]+ (?: [-+.0-9"'#(] | [A-Z]\w*[ \t\r]*(?:[,;]|$) ) )""",
    re.IGNORECASE | re.VERBOSE,
)
_VERSION = re.compile(rb"[ \t][A-Z]{3,8}/[0-9][.0-9]*[ \t\r]*$", re.IGNORECASE)  # as of HTTP
_NAMES = (
    (re.compile(rb"\x16\x03"), "TLS"),
    (re.compile(rb"SSH-"), "SSH"),
    (re.compile(rb"\x1b%-12345X|@PJL"), "a printer's language"),
    (re.compile(rb"[^\n]*[ \t]RTSP/", re.IGNORECASE), "RTSP"),
    (re.compile(rb"[^\n]*[ \t]SIP/|[A-Z]+ sips?:", re.IGNORECASE), "SIP"),
    (re.compile(rb"[^\n]*[ \t]HTTP/|[A-Z]+[ \t]+/|[A-Z-]+:[ \t]", re.IGNORECASE), "HTTP"),
)


class ForeignProtocol(Exception):
    """What comes is not SCPI; the words say what it looks like."""


class FirstLine:
    """Holds back what a client sends until its first line that is not blank can be judged."""

    def __init__(self) -> None:
        self._held = bytearray()

    def take(self, data: bytes) -> bytes:
        """What may be heard now: nothing yet, or all that came. Raises `ForeignProtocol`."""
        self._held += data
        leading = _LEADING.match(self._held)
        assert leading is not None  # it matches nothing, too
        del self._held[: leading.end()]
        if not self._held:
            return b""
        end = self._held.find(b"\n", 0, JUDGED)
        if _BEGINS.match(self._held) is None:
            raise ForeignProtocol(_named(self._held))
        if end < 0 and len(self._held) < JUDGED:
            return b""
        line = bytes(self._held[: JUDGED if end < 0 else end])
        if _FORM.match(line) is None or _VERSION.search(line) is not None:
            raise ForeignProtocol(_named(self._held))
        return bytes(self._held)


def _named(data: bytearray) -> str:
    found = (name for pattern, name in _NAMES if pattern.match(data[:JUDGED]))
    return next(found, "no SCPI")
