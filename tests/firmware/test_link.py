"""Frames, at both ends: the C of the firmware against Python."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.rig.board import framing, protocol
from tests.firmware.built import ROOT, needs_c

SHIM = """
#include "link.h"
static LinkIn in;
static LinkFrame frame;
uint16_t bad(void) { return in.bad; }
int take(uint8_t byte) { return link_take(&in, byte, &frame); }
int id(void) { return frame.id; }
int sequence(void) { return frame.sequence; }
int size(void) { return frame.size; }
int field(int k) { return frame.fields[k]; }
int stuffed(uint8_t id, uint8_t sequence, const uint8_t *fields, uint8_t size, uint8_t *to)
{
    return link_stuffed(id, sequence, fields, size, to);
}
uint16_t crc(uint16_t before, uint8_t byte) { return link_crc(before, byte); }
"""


@pytest.fixture(scope="module")
def c(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The firmware's own code, compiled for this machine."""
    folder: Path = tmp_path_factory.mktemp("link")
    (folder / "shim.c").write_text(SHIM)
    core = ROOT / "firmware" / "core"
    command = ["cc", "-std=c99", "-Wall", "-Werror", "-shared", "-fPIC", f"-I{core}"]
    command += ["-o", str(folder / "link.so"), str(folder / "shim.c"), str(core / "link.c")]
    subprocess.run(command, check=True)
    library = ctypes.CDLL(str(folder / "link.so"))
    library.bad.restype = library.crc.restype = ctypes.c_uint16
    return library


def _taken(c: ctypes.CDLL, data: bytes) -> list[tuple[int, int, bytes]]:
    """Frames that the C finds in a stream."""
    found = []
    for byte in data:
        if c.take(byte):
            fields = bytes(c.field(k) for k in range(c.size()))
            found.append((c.id(), c.sequence(), fields))
    return found


def test_crc_is_the_one_that_the_catalogues_call_ccitt_false() -> None:
    assert framing.crc16(b"123456789") == 0x29B1


@given(st.binary(max_size=300))
def test_stuffing_leaves_no_zero_and_comes_undone(data: bytes) -> None:
    stuffed = framing.stuff(data)
    assert 0 not in stuffed
    assert framing.plain(stuffed) == data


@needs_c
@given(st.integers(0, 0xFFFF), st.integers(0, 255))
def test_c_computes_the_same_crc(c: ctypes.CDLL, before: int, byte: int) -> None:
    assert c.crc(before, byte) == framing.crc16(bytes([byte]), before)


@needs_c
@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=40))
def test_c_frames_as_python_does(c: ctypes.CDLL, id_: int, number: int, fields: bytes) -> None:
    room = ctypes.create_string_buffer(64)
    size = c.stuffed(id_, number, fields, len(fields), room)
    assert room.raw[:size] == framing.frame(bytes([id_, number]) + fields)


@needs_c
@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=40))
def test_c_reads_what_python_frames(c: ctypes.CDLL, id_: int, number: int, fields: bytes) -> None:
    framed = framing.frame(bytes([id_, number]) + fields)
    assert _taken(c, b"\0" + framed) == [(id_, number, fields)]


@needs_c
@given(st.lists(st.binary(max_size=40), max_size=6), st.binary(max_size=200), st.booleans())
def test_both_ends_find_the_same_frames_in_noise(
    c: ctypes.CDLL, parts: list[bytes], noise: bytes, first: bool
) -> None:
    frames = b"".join(framing.frame(b"\x05\x01" + part) for part in parts)
    data = b"\0" + (noise + b"\0" + frames if first else frames + noise) + b"\0"
    short = [body for body in framing.Stream().take(data) if len(body) <= 46]
    assert [bytes([i, n]) + fields for i, n, fields in _taken(c, data)] == short


@needs_c
@given(st.binary(min_size=1, max_size=40), st.data())
def test_a_changed_byte_is_noticed_by_both(
    c: ctypes.CDLL, fields: bytes, data: st.DataObject
) -> None:
    framed = bytearray(framing.frame(b"\x05\x01" + fields))
    place = data.draw(st.integers(0, len(framed) - 2))
    framed[place] ^= 1 << data.draw(st.integers(0, 7))
    before = c.bad()
    assert _taken(c, b"\0" + bytes(framed)) == []
    assert framing.Stream().take(bytes(framed)) == []
    assert c.bad() != before


def test_every_message_fits_a_frame_and_comes_back() -> None:
    for side in (protocol.HOST, protocol.BOARD):
        for message in side.values():
            values = dict.fromkeys(message.fields, 1)
            body = framing.unframe(protocol.encode(message.name, 7, **values)[:-1])
            assert body is not None
            frame = protocol.decode(body)
            assert frame is not None
            assert frame == (message.name, 7, values)
            assert len(body) + 2 <= 48


def test_numbers_of_messages_are_their_own() -> None:
    ids = [m.id for side in (protocol.HOST, protocol.BOARD) for m in side.values()]
    assert len(set(ids)) == len(ids)
