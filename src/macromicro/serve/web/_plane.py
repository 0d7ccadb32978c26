"""The Preisach plane of the wires, driven by the temperature estimate."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from macromicro.hysteresis.everett import from_density
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable

SMALLEST = 0.3  # degC; smaller reversals are remembered but not drawn
_CELLS = 30


class Plane:
    """`ambient` and `hottest` [degC] are the ends of the plane if there is no `table`."""

    def __init__(self, ambient: float, hottest: float, table: FodTable | None = None) -> None:
        self._measured = table is not None
        if table is None:
            # Any density does: only the memory is read.
            step = (hottest - ambient) / _CELLS
            everywhere = from_density(
                np.ones((_CELLS, _CELLS)) * _TRIANGLE, ambient, step, _CELLS + 1
            )
            table = FodTable.from_everett(everywhere)
        self.model = Preisach(table)

    def feed(self, temperature: NDArray[np.float64]) -> None:
        """Follow the temperatures [degC], float64[rows]; NaN is skipped."""
        good = temperature[np.isfinite(temperature)]
        if good.size == 0:
            return
        turns = np.sign(np.diff(good))
        # Between its turning points a way leaves the same memory as one step.
        keep = np.concatenate([[0], np.flatnonzero(turns[1:] != turns[:-1]) + 1, [good.size - 1]])
        for u in good[keep].tolist():
            self.model.step(u)

    def forget(self) -> None:
        """Start again with a cold estimate."""
        self.model.reset()

    def words(self) -> dict[str, Any]:
        """Extent and input [degC], corners (M, m) [degC], contraction [mm] or None."""
        model = self.model
        corners = [
            [round(top, 2), round(low, 2)]
            for top, low in model.corners.tolist()
            if math.isfinite(low) and top - low >= SMALLEST
        ]
        return {
            "low": model.table.lo,
            "high": model.table.hi,
            "u": round(model.u, 2),
            "corners": corners,
            "contraction": round(model.f, 4) if self._measured else None,
        }


_TRIANGLE = np.tril(np.ones((_CELLS, _CELLS)))
