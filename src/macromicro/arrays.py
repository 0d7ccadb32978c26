"""Names for arrays in annotations, and how a few floats are written into one at once."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def packed(number: int) -> struct.Struct:
    """What writes so many floats into an array or another buffer, at a place in bytes.

    For a loop that runs in real time: numpy's assignment of a tuple takes four times as long.

    Parameters
    ----------
    number : int
        How many.

    Returns
    -------
    struct.Struct
        Its `pack_into` takes the buffer, the place and the floats.
    """
    return struct.Struct(f"={number}d")
