"""The slow reference: every relay of (2.2) by itself. For tests and pictures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.hysteresis.everett import Array


class Relays(NamedTuple):
    """Relays by number: `up` (alpha) and `down` (beta) thresholds and `weights` [sum 1]."""

    up: Array
    down: Array
    weights: Array


def relay_grid(weights: Array, lo: float, step: float) -> Relays:
    """One relay in each cell with weight, for the cell weights of `from_density`.

    Thresholds lie inside the cell, so an input on the grid never meets one exactly.
    """
    rows, columns = np.nonzero(weights)
    chosen = weights[rows, columns]
    up = np.asarray(lo + step * (rows + 0.75), dtype=np.float64)
    down = np.asarray(lo + step * (columns + 0.25), dtype=np.float64)
    return Relays(up, down, chosen / float(chosen.sum()))


def relay_step(
    relays: Relays, on: npt.NDArray[np.bool_], u: float
) -> tuple[npt.NDArray[np.bool_], float]:
    """Which relays are up at input `u`, and the output (2.2), counted from 0 to 1.

    (2.2) counts relays as -1 and 1: its output is twice this one less 1.
    """
    after = (on & ~(u <= relays.down)) | (u >= relays.up)
    return after, float(np.sum(relays.weights[after]))
