"""The protocol of host and board, as protocol.toml defines it."""

from __future__ import annotations

import struct
import tomllib
from importlib import resources
from typing import Any, NamedTuple

from macromicro.rig.board import framing

FORMATS = {"u8": "B", "u16": "H", "u32": "I", "i16": "h", "i32": "i", "f32": "f"}


def table(name: str) -> dict[str, Any]:
    file = resources.files("macromicro.rig.board").joinpath(f"{name}.toml")
    return tomllib.loads(file.read_text("utf-8"))


class Message(NamedTuple):
    name: str
    id: int  # first byte
    fields: dict[str, str]  # types by name, keys of `FORMATS`
    packer: struct.Struct  # of the fields


class Frame(NamedTuple):
    """A received frame."""

    name: str
    sequence: int  # 0 to 255, one more each time
    values: dict[str, Any]


def _messages(side: str) -> dict[str, Message]:
    return {
        name: Message(
            name,
            entry["id"],
            entry["fields"],
            struct.Struct("<" + "".join(FORMATS[kind] for kind in entry["fields"].values())),
        )
        for name, entry in SPEC[side].items()
    }


SPEC = table("protocol")
VERSION: int = SPEC["version"]
FIRMWARE: int = SPEC["firmware"]
BAUD: int = SPEC["baud"]
TABLE: int = SPEC["table"]
HOST, BOARD = _messages("host"), _messages("board")
_BY_ID = {message.id: message for message in (*HOST.values(), *BOARD.values())}
REFUSALS = {number: name for name, number in SPEC["refusals"].items()}
BOARDS = {number: name for name, number in SPEC["boards"].items()}


def encode(name: str, sequence: int, **values: float) -> bytes:
    """Encode a frame."""
    message = HOST[name] if name in HOST else BOARD[name]
    fields = message.packer.pack(*(values[field] for field in message.fields))
    return framing.frame(bytes((message.id, sequence & 0xFF)) + fields)


def decode(body: bytes) -> Frame | None:
    """Decode a frame."""
    message = _BY_ID.get(body[0])
    if message is None or len(body) != 2 + message.packer.size:
        return None
    values = dict(zip(message.fields, message.packer.unpack(body[2:]), strict=True))
    return Frame(message.name, body[1], values)


def bits(word: int, names: dict[str, int]) -> dict[str, bool]:
    """Bits of a word by name."""
    return {name: bool(word >> bit & 1) for name, bit in names.items()}
