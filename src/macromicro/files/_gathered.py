"""Arrays of a container file as columns: vectors by name, matrices column by column, scalars."""

from __future__ import annotations

from typing import Any

import numpy as np

from macromicro.arrays import Array

_WIDEST = 64  # columns of a matrix; wider ones are no records


class Gathered:
    """Columns and constants found so far."""

    def __init__(self) -> None:
        self.columns: dict[str, Array] = {}
        self.constants: dict[str, float] = {}
        self.units: dict[str, str] = {}

    def add(self, name: str, value: Any, unit: str = "") -> None:
        """Add an array of numbers, times or truth values; others are ignored."""
        values = np.asarray(value)
        if values.dtype.kind in "mM":
            values = values.astype("datetime64[ns]" if values.dtype.kind == "M" else "m8[ns]")
            values, unit = (values - values.ravel()[:1]).astype(np.int64) * 1e-9, "s"
        if values.dtype.names:
            for field in values.dtype.names:
                self.add(f"{name}.{field}" if name else field, values[field])
            return
        if values.dtype.kind not in "fiub" or not values.size:
            return
        if values.size == 1:
            self.constants[name] = float(values.ravel()[0])
        elif values.size == max(values.shape):
            self._put(name, values.ravel(), unit)
        elif values.ndim == 2 and min(values.shape) <= _WIDEST:
            block = (
                values if values.shape[0] >= values.shape[1] or values.shape[1] < 3 else values.T
            )
            for k in range(block.shape[1]):
                self._put(f"{name}{k + 1}", block[:, k], unit)

    def _put(self, name: str, values: Any, unit: str) -> None:
        self.columns[name] = np.ascontiguousarray(values, dtype=np.float64)
        if unit:
            self.units[name] = unit
