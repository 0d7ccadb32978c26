"""Programme data of IEEE 488.2 (7.7): the elements behind a header."""

from __future__ import annotations

import re
from typing import NamedTuple

from macromicro.serve.scpi.errors import ScpiError

WORD, NUMBER, STRING, BLOCK = "word", "number", "string", "block"
BLANK = bytes(k for k in range(33) if k != 10)  # white space is all of these: 7.4.1.2
_NUMBER = re.compile(rb"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[eE]([+-]?[0-9]+))?")
_BASED = re.compile(rb"#([hH][0-9A-Fa-f]+|[qQ][0-7]+|[bB][01]+)")
_BASES = {"H": 16, "Q": 8, "B": 2}
_SUFFIX = re.compile(rb"[\x00-\x09\x0b-\x20]*([A-Za-z%][A-Za-z0-9/.%*^-]*)")
_BLANKS = re.compile(b"[" + re.escape(BLANK) + b"]*")
_WORD = re.compile(rb"[A-Za-z][A-Za-z0-9_]*")
_BEHIND = (b"", b",", b";", *(bytes([k]) for k in BLANK))
# A quote in a string is written twice; the last one stands alone.
_STRINGS = {
    q: re.compile(q + b"([^" + q + b"]*+(?:" + q * 2 + b"[^" + q + b"]*+)*+)" + q)
    for q in (b'"', b"'")
}
LONGEST_STRING = 4096  # bytes, its quotes counted
LONGEST_WORD = 40
LONGEST_SUFFIX = 12
MOST_DIGITS = 255
LARGEST_EXPONENT = 32000
MOST_ELEMENTS = 20


class Element(NamedTuple):
    """One element of program data."""

    kind: str
    text: str
    suffix: str = ""  # unit in capitals, or ""
    data: bytes = b""


def elements(message: bytes, place: int) -> tuple[list[Element], int]:
    """The elements from `place` on, and where their unit ends; raises ScpiError -101 to -178."""
    found: list[Element] = []
    place = blank(message, place)
    if place >= len(message) or message[place : place + 1] == b";":
        return found, place
    while True:
        element, place = _element(message, place)
        found.append(element)
        if len(found) > MOST_ELEMENTS:
            raise ScpiError(-108, f"more than {MOST_ELEMENTS} parameters")
        place = blank(message, place)
        mark = message[place : place + 1]
        if mark in (b"", b";"):
            return found, place
        if mark != b",":
            raise ScpiError(-103, f"{excerpt(message, place)} behind {excerpt(element.text)}")
        place = blank(message, place + 1)


def blank(message: bytes, place: int) -> int:
    """The first place from `place` on without white space."""
    found = _BLANKS.match(message, place)
    assert found is not None  # it matches nothing, too
    return found.end()


def excerpt(found: bytes | str, place: int = 0) -> str:
    """A printable excerpt of the message from `place` on, of bounded length."""
    head = found[place : place + 30]
    text = head.decode("ascii", "replace") if isinstance(head, bytes) else head
    return "".join(c if " " <= c <= "~" else "?" for c in text)


def _element(message: bytes, place: int) -> tuple[Element, int]:
    mark = message[place : place + 1]
    if mark in (b'"', b"'"):
        return _string(message, place)
    if mark == b"#":
        return _based_number(message, place)
    if word := _WORD.match(message, place):
        if len(word[0]) > LONGEST_WORD:
            raise ScpiError(-144, excerpt(word[0]))
        return Element(WORD, word[0].decode()), word.end()
    if number := _NUMBER.match(message, place):
        return _number(message, number)
    if mark == b"(":
        raise ScpiError(-178, excerpt(message, place))
    if mark in (b"", b",", b";"):
        raise ScpiError(-109, "nothing beside a comma")
    if mark in (b"+", b"-", b"."):
        raise ScpiError(-121, excerpt(message, place))
    raise ScpiError(-101, excerpt(message, place))


def _number(message: bytes, number: re.Match[bytes]) -> tuple[Element, int]:
    if len(number[1].strip(b"+-").replace(b".", b"")) > MOST_DIGITS:
        raise ScpiError(-124, excerpt(number[1]))
    exponent = (number[2] or b"0").lstrip(b"+-0")
    if len(exponent) > 5 or int(exponent or b"0") > LARGEST_EXPONENT:
        raise ScpiError(-123, excerpt(number[0]))
    end, suffix = number.end(), ""
    if unit := _SUFFIX.match(message, end):
        if len(unit[1]) > LONGEST_SUFFIX:
            raise ScpiError(-134, excerpt(unit[1]))
        end, suffix = unit.end(), unit[1].decode().upper()
    elif message[end : end + 1] not in _BEHIND:
        raise ScpiError(-121, excerpt(message, number.start()))
    return Element(NUMBER, number[0].decode(), suffix), end


def _string(message: bytes, place: int) -> tuple[Element, int]:
    quote = message[place : place + 1]
    found = _STRINGS[quote].match(message, place, place + LONGEST_STRING)
    if found is None:
        if len(message) - place > LONGEST_STRING:
            raise ScpiError(-151, f"no closing quote within {LONGEST_STRING} bytes")
        raise ScpiError(-151, "no closing quote")
    place = found.end()
    try:
        text = found[1].replace(quote * 2, quote).decode("utf-8")
    except UnicodeDecodeError:
        raise ScpiError(-151, "not UTF-8") from None
    if not text.isprintable():
        raise ScpiError(-151, "control characters")
    return Element(STRING, text), place


def _based_number(message: bytes, place: int) -> tuple[Element, int]:
    """A number in base 16, 8 or 2 (7.7.4), or a block of given length (7.7.6)."""
    if based := _BASED.match(message, place):
        digits = based[1].decode()
        if len(digits) > 17:
            raise ScpiError(-124, excerpt(based[0]))
        value = int(digits[1:], _BASES[digits[0].upper()])
        return Element(NUMBER, str(value)), based.end()
    head = message[place + 1 : place + 2]
    if not head.isdigit() or head == b"0":
        raise ScpiError(-161, "accepted: #<digits><length><bytes>, its length given")
    start = place + 2 + int(head)
    length = message[place + 2 : start]
    if len(length) < int(head) or not length.isdigit():
        raise ScpiError(-161, "its length is not a number")
    end = start + int(length)
    if end > len(message):
        raise ScpiError(-161, "shorter than it says")
    return Element(BLOCK, "", "", message[start:end]), end
