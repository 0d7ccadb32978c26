"""Slopes of the errors of free runs over pieces, whose starts follow the parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.axis_pieces import Pieces, Settled, cleared, runs, settled
from macromicro.identify.central import central


def slopes(
    pieces: list[Pieces],
    model: Callable[[Array], Any],
    at: Array,
    nudge: Array,
    bounds: tuple[Array, Array],
) -> Array:
    """Slopes of the errors by the parameters, less what the starts of the pieces take up.

    Parameters
    ----------
    pieces : list[Pieces]
        Of all records.
    model : Callable[[ndarray], Any]
        The model by its parameters.
    at : ndarray, shape (p,)
        These.
    nudge : ndarray, shape (p,)
        How far to go to either side.
    bounds : tuple[ndarray, ndarray], shape (p,) each
        No further than there.

    Returns
    -------
    ndarray, shape (n, p)
        Of the errors of all pieces.
    """
    parts = []
    for one in pieces:
        here = settled(one, model(at))

        def missed(z: Array, one: Pieces = one, here: Settled = here) -> Array:
            return -runs(one, model(z), here.speeds, here.at)

        found = central(missed, at, nudge, *bounds)
        parts.append(np.stack([cleared(one, here, column) for column in found.T], axis=1))
    return np.concatenate(parts)
