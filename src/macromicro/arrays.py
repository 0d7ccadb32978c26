"""Array types for annotations, and fast writing of floats."""

from __future__ import annotations

import struct
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
State = TypeVar("State")


def own(state: State) -> State:
    """A copy of a state whose arrays are its own."""
    if isinstance(state, np.ndarray):
        return cast("State", state.copy())
    if not isinstance(state, tuple):
        return state
    parts = map(own, state)
    kind = type(state)
    return cast("State", kind(*parts) if hasattr(kind, "_fields") else tuple(parts))


def spans(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row, and the row behind the last, of each stretch where a condition holds."""
    on = np.concatenate(([False], holds, [False]))
    begins, ends = np.flatnonzero(on[1:] & ~on[:-1]), np.flatnonzero(~on[1:] & on[:-1])
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def packed(number: int) -> struct.Struct:
    """A function that writes so many floats into a buffer at a byte offset, faster than numpy."""
    return struct.Struct(f"={number}d")
