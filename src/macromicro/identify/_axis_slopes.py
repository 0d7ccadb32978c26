"""Slopes of the errors over pieces whose initial states follow the parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._axis_pieces import Pieces, Settled, cleared, runs, settled
from macromicro.identify._central import central


def slopes(
    pieces: list[Pieces],
    model: Callable[[Array], Any],
    at: Array,
    nudge: Array,
    bounds: tuple[Array, Array],
) -> Array:
    parts = []
    for one in pieces:
        here = settled(one, model(at))

        def missed(z: Array, one: Pieces = one, here: Settled = here) -> Array:
            return -runs(one, model(z), here.speeds, here.at)

        found = central(missed, at, nudge, *bounds)
        parts.append(np.stack([cleared(one, here, column) for column in found.T], axis=1))
    return np.concatenate(parts)
