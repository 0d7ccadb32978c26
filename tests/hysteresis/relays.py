"""The slow reference: every relay of (2.2) by itself."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array


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


def refined(weights: Array) -> Array:
    """The same density on a grid of half the step: off the diagonal a quarter each.

    A cell on the diagonal is all relays of zero width: halves on the finer diagonal.
    """
    finer = np.kron(weights, np.full((2, 2), 0.25))
    diagonal = np.repeat(np.diag(weights), 2)
    size = finer.shape[0]
    for k in range(0, size, 2):
        finer[k : k + 2, k : k + 2] = 0.0
    finer[np.arange(size), np.arange(size)] = 0.5 * diagonal
    return np.asarray(finer, dtype=np.float64)


def relay_start(
    relays: Relays, start: str = "negative", swing: Iterable[float] = ()
) -> npt.NDArray[np.bool_]:
    """Which relays are up at the start: "negative" none, "positive" all, "demagnetised" what
    the turning points of a decaying `swing` leave."""
    on = np.full(relays.up.shape, start == "positive")
    for u in swing if start == "demagnetised" else ():
        on, _ = relay_step(relays, on, u)
    return on


def relay_run(
    relays: Relays, on: npt.NDArray[np.bool_], inputs: Array
) -> tuple[npt.NDArray[np.bool_], Array]:
    """The relays after `inputs` and the outputs (2.2) along them, counted from 0 to 1."""
    outputs = np.empty(len(inputs))
    for t, u in enumerate(inputs):
        on, outputs[t] = relay_step(relays, on, float(u))
    return on, outputs
