"""The board's parameters as a list of numbers, in the order in which they are written."""

from __future__ import annotations

from typing import Any

import numpy as np

from macromicro.rig.board import framing
from macromicro.rig.board.control import Board
from macromicro.rig.board.protocol import BOARD, FORMATS, HOST


def flat(params: Any, path: str = "") -> dict[str, float]:
    """Every number of the parameters, by its path; the numbers of tables last.

    Parameters
    ----------
    params : Any
        A `control.Board`, or a part of it.
    path : str, optional
        Of the part.

    Returns
    -------
    dict[str, float]
        As they are.
    """
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
    """The parameters as the board keeps them: 32 bits each.

    Parameters
    ----------
    params : Board
        What is to be written.

    Returns
    -------
    bytes
        Little endian; `begin` carries their CRC.
    """
    return np.array(list(flat(params).values()), "<f4").tobytes()


def layout(params: Board) -> int:
    """A number that changes with the protocol's frames and the names of the parameters.

    Parameters
    ----------
    params : Board
        Any.

    Returns
    -------
    int
        16 bits, which the board says in `identity`.
    """
    known = [f"{m.id} {m.name} {m.fields}" for m in (*HOST.values(), *BOARD.values())]
    text = "\n".join([*known, *FORMATS, *flat(params)])
    return framing.crc16(text.encode())


def single(value: float) -> float:
    """A number as 32 bits hold it.

    Parameters
    ----------
    value : float
        Any.

    Returns
    -------
    float
        The nearest one.
    """
    return float(np.float32(value))
