"""The board's parameters as a list of numbers in the order of transmission."""

from __future__ import annotations

from typing import Any

import numpy as np

from macromicro.rig.board import framing
from macromicro.rig.board.control import Board
from macromicro.rig.board.protocol import BOARD, FORMATS, HOST


def flat(params: Any, path: str = "") -> dict[str, float]:
    """Every number of the parameters, by its path; tables last."""
    found: dict[str, float] = {}
    tables: dict[str, float] = {}
    for name, value in zip(params._fields, params, strict=True):
        place = f"{path}.{name}" if path else name
        if isinstance(value, tuple):
            found |= {k: v for k, v in flat(value, place).items() if "[" not in k}
            tables |= {k: v for k, v in flat(value, place).items() if "[" in k}
        elif isinstance(value, np.ndarray):
            tables |= {f"{place}[{k}]": float(each) for k, each in enumerate(value)}
        else:
            found[place] = float(value)
    return found | tables


def words(params: Board) -> bytes:
    """The parameters as 32-bit words."""
    return np.array(list(flat(params).values()), "<f4").tobytes()


def layout(params: Board) -> int:
    """A checksum of the protocol's frames and the parameters' names."""
    known = [f"{m.id} {m.name} {m.fields}" for m in (*HOST.values(), *BOARD.values())]
    text = "\n".join([*known, *FORMATS, *flat(params)])
    return framing.crc16(text.encode())


def single(value: float) -> float:
    """A number rounded to 32 bits."""
    return float(np.float32(value))
