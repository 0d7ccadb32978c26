"""Central differences within bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from macromicro.arrays import Array


def central(
    made: Callable[[Array], Array], at: Array, nudge: Array, low: Array, high: Array
) -> Array:
    columns = []
    for k in range(len(at)):
        up, down = at.copy(), at.copy()
        up[k], down[k] = min(at[k] + nudge[k], high[k]), max(at[k] - nudge[k], low[k])
        columns.append((made(up) - made(down)) / (up[k] - down[k]))
    return np.stack(columns, axis=1)
