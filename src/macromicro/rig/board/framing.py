"""Frames on a serial line: COBS between zero bytes, a CRC at the end."""

from __future__ import annotations

from binascii import crc_hqx

_START = 0xFFFF
LONGEST = 64  # bytes of a frame, its CRC included


def crc16(data: bytes, crc: int = _START) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, from 0xFFFF, nothing reflected.

    Parameters
    ----------
    data : bytes
        Any.
    crc : int, optional
        Of what came before.

    Returns
    -------
    int
        0 to 0xFFFF; "123456789" gives 0x29B1.
    """
    return crc_hqx(data, crc)


def stuffed(data: bytes) -> bytes:
    """Consistent overhead byte stuffing (Cheshire and Baker, 1999): no zero is left.

    Parameters
    ----------
    data : bytes
        Any.

    Returns
    -------
    bytes
        Longer by one byte, and by one for each 254 without a zero.
    """
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
    """What `stuffed` made the bytes of.

    Parameters
    ----------
    data : bytes
        Without the zero behind them.

    Returns
    -------
    bytes | None
        None for what cannot be.
    """
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


def framed(data: bytes) -> bytes:
    """Bytes as a frame on the line, CRC and zero included.

    Parameters
    ----------
    data : bytes
        Id, sequence, fields.

    Returns
    -------
    bytes
        What is sent.
    """
    return stuffed(data + crc16(data).to_bytes(2, "little")) + b"\0"


def unframed(data: bytes) -> bytes | None:
    """Contents of a frame.

    Parameters
    ----------
    data : bytes
        As on the line, without the zero behind it.

    Returns
    -------
    bytes | None
        Id, sequence, fields; None where the CRC says that something was lost or changed.
    """
    found = plain(data)
    if found is None or len(found) < 4:
        return None
    body, crc = found[:-2], int.from_bytes(found[-2:], "little")
    return body if crc16(body) == crc else None


class Stream:
    """Frames out of a stream of bytes, and how many were no good."""

    def __init__(self) -> None:
        self._rest = bytearray()
        self.bad = 0

    def take(self, data: bytes) -> list[bytes]:
        """Frames that end within these bytes.

        Parameters
        ----------
        data : bytes
            As they came.

        Returns
        -------
        list[bytes]
            Contents of each whole one.
        """
        found = []
        *ended, rest = data.split(b"\0")
        for part in ended:
            self._rest += part
            if self._rest:
                body = unframed(bytes(self._rest))
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
