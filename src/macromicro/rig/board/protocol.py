"""What host and board say to each other, as protocol.toml has it."""

from __future__ import annotations

import struct
import tomllib
from importlib import resources
from typing import Any, NamedTuple

from macromicro.rig.board import framing

FORMATS = {"u8": "B", "u16": "H", "u32": "I", "i16": "h", "i32": "i", "f32": "f"}


def table(name: str) -> dict[str, Any]:
    """A TOML file of this package.

    Parameters
    ----------
    name : str
        "protocol" or "pins".

    Returns
    -------
    dict[str, Any]
        What stands in it.
    """
    file = resources.files("macromicro.rig.board").joinpath(f"{name}.toml")
    return tomllib.loads(file.read_text("utf-8"))


class Message(NamedTuple):
    """A kind of frame.

    Attributes
    ----------
    name : str
        Of it.
    id : int
        First byte.
    fields : dict[str, str]
        Types by name, keys of `FORMATS`.
    packer : struct.Struct
        Of the fields.
    """

    name: str
    id: int
    fields: dict[str, str]
    packer: struct.Struct


class Frame(NamedTuple):
    """A frame that came.

    Attributes
    ----------
    name : str
        Of its message.
    sequence : int
        0 to 255, one more each time.
    values : dict[str, Any]
        By field.
    """

    name: str
    sequence: int
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


def told(name: str, sequence: int, **values: float) -> bytes:
    """A frame as it is sent.

    Parameters
    ----------
    name : str
        Of a message of either end.
    sequence : int
        Its number; the lowest byte counts.
    **values : float
        Each of its fields.

    Returns
    -------
    bytes
        With the zero behind it.
    """
    message = HOST[name] if name in HOST else BOARD[name]
    fields = message.packer.pack(*(values[field] for field in message.fields))
    return framing.framed(bytes((message.id, sequence & 0xFF)) + fields)


def heard(body: bytes) -> Frame | None:
    """What a frame says.

    Parameters
    ----------
    body : bytes
        Of `framing.unframed`.

    Returns
    -------
    Frame | None
        None for one that this protocol does not have.
    """
    message = _BY_ID.get(body[0])
    if message is None or len(body) != 2 + message.packer.size:
        return None
    values = dict(zip(message.fields, message.packer.unpack(body[2:]), strict=True))
    return Frame(message.name, body[1], values)


def bits(word: int, names: dict[str, int]) -> dict[str, bool]:
    """Bits of a word by name.

    Parameters
    ----------
    word : int
        Of a frame.
    names : dict[str, int]
        Which bit each is, as in SPEC["lines"].

    Returns
    -------
    dict[str, bool]
        Which are set.
    """
    return {name: bool(word >> bit & 1) for name, bit in names.items()}
