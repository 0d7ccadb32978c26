"""The triangle of a QR decomposition: all that least squares needs of a table, however long."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from macromicro.arrays import Array

_ROWS = 100_000  # at a time: long tables are not copied as a whole


def triangle(tables: Iterable[Array]) -> Array:
    """R of a QR decomposition of tables, one below the other, found stretch by stretch.

    R'R is the product of the columns of all of them with each other.

    Parameters
    ----------
    tables : Iterable[ndarray]
        Shape (n, p) each, of one p; one or more.

    Returns
    -------
    ndarray, shape (min(n, p), p)
        Upper triangular; n is the number of all rows.
    """
    found: Array | None = None
    for table in tables:
        for stretch in stretches(table):
            both = stretch if found is None else np.concatenate([found, stretch])
            found = np.asarray(np.linalg.qr(both, mode="r"))
    assert found is not None
    return found


def stretches(table: Array) -> Iterator[Array]:
    """A table in parts, as views.

    Parameters
    ----------
    table : ndarray, shape (n, ...)
        Any rows.

    Yields
    ------
    ndarray, shape (m, ...)
        Up to 100 000 rows each, in their order; one of no rows where there are none.
    """
    for first in range(0, max(len(table), 1), _ROWS):
        yield table[first : first + _ROWS]
