"""Frames on a serial line: COBS between zero bytes, with a CRC."""

from __future__ import annotations

from binascii import crc_hqx

_START = 0xFFFF
LONGEST = 64  # bytes of a frame, its CRC included


def crc16(data: bytes, crc: int = _START) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, from 0xFFFF, nothing reflected."""
    return crc_hqx(data, crc)


def stuff(data: bytes) -> bytes:
    """Consistent overhead byte stuffing (Cheshire and Baker, 1999)."""
    out, block = bytearray(), bytearray()
    for byte in data:
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            out.append(len(block) + 1)
            out += block
            if byte:
                block = bytearray()
                continue
            block = bytearray()
    out.append(len(block) + 1)
    return bytes(out + block)


def plain(data: bytes) -> bytes | None:
    """The inverse of `stuffed`."""
    out, place = bytearray(), 0
    while place < len(data):
        length = data[place]
        block = data[place + 1 : place + length]
        if length == 0 or len(block) != length - 1 or 0 in block:
            return None
        out += block
        place += length
        if length < 255 and place < len(data):
            out.append(0)
    return bytes(out) if data else None


def frame(data: bytes) -> bytes:
    """A frame for the line, CRC and zero included."""
    return stuff(data + crc16(data).to_bytes(2, "little")) + b"\0"


def unframe(data: bytes) -> bytes | None:
    found = plain(data)
    if found is None or len(found) < 4:
        return None
    body, crc = found[:-2], int.from_bytes(found[-2:], "little")
    return body if crc16(body) == crc else None


class Stream:
    """Splits a byte stream into frames and counts bad ones."""

    def __init__(self) -> None:
        self._rest = bytearray()
        self.bad = 0

    def take(self, data: bytes) -> list[bytes]:
        found = []
        *ended, rest = data.split(b"\0")
        for part in ended:
            self._rest += part
            if self._rest:
                body = unframe(bytes(self._rest))
                if body is None:
                    self.bad += 1
                else:
                    found.append(body)
            self._rest.clear()
        self._rest += rest
        if len(self._rest) > 4 * LONGEST:  # noise without a zero
            self._rest.clear()
            self.bad += 1
        return found
