"""R of a QR decomposition, for least squares on long tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from macromicro.arrays import Array

_ROWS = 100_000  # at a time: long tables are not copied as a whole


def triangle(tables: Iterable[Array]) -> Array:
    """R of stacked tables, computed stretch by stretch."""
    found: Array | None = None
    for table in tables:
        for stretch in stretches(table):
            both = stretch if found is None else np.concatenate([found, stretch])
            found = np.asarray(np.linalg.qr(both, mode="r"))
    assert found is not None
    return found


def stretches(table: Array) -> Iterator[Array]:
    for first in range(0, max(len(table), 1), _ROWS):
        yield table[first : first + _ROWS]
