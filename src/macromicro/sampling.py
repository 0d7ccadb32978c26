"""Points of the unit cube, drawn from a seed: what sweeps, studies and searches begin with.

The designs are those of `scipy.stats.qmc`; independent points are numpy's. Which points a
seed gives depends on scipy's version, so `drawn_by` names it.
"""

from __future__ import annotations

import importlib.metadata
import warnings
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from macromicro.arrays import Array

Seed = int | tuple[int, ...]

METHODS = ("random", "lhs", "sobol")
MAX_LATIN = 20_000_000  # numbers of a Latin hypercube, which is kept in memory: 160 MB
MAX_SOBOL, MAX_WIDTH = 2**30, 21_201  # points and dimensions that scipy's sequence has
_BITS = 32  # of Sobol points; scipy goes forward in no more
_WORDS = 4  # numbers that Philox gives per step


def drawn_by() -> str:
    """What draws the points, with its version.

    Returns
    -------
    str
        Such as "scipy 1.17.1"; another version may give other points for the same seed.
    """
    return f"scipy {importlib.metadata.version('scipy')}"


def latin(columns: int, rows: int, seed: int | Sequence[int]) -> Array:
    """Draw a Latin hypercube: in every column each of `rows` equal parts has one point.

    Parameters
    ----------
    columns, rows : int
        Dimensions and points, both 1 or more.
    seed : int or sequence of int
        Each seed, and each sequence of them, is a random stream of its own.

    Returns
    -------
    ndarray, shape (rows, columns)
        Numbers from 0 to 1.

    References
    ----------
    M. D. McKay, R. J. Beckman and W. J. Conover, Technometrics 21 (1979) 239-245.
    """
    from scipy.stats import qmc

    found: Array = qmc.LatinHypercube(columns, rng=np.random.default_rng(seed)).random(rows)
    return found


def scaled(share: Array, low: float, high: float, *, log: bool = False) -> Array:
    """Put points of the unit interval into a range.

    Parameters
    ----------
    share : ndarray
        From 0 to 1, of any shape.
    low, high : float
        Ends of the range; above 0 on a logarithmic scale.
    log : bool
        Even in the logarithm.

    Returns
    -------
    ndarray
        Of the same shape, from `low` to `high`.
    """
    return low * (high / low) ** share if log else low + (high - low) * share


@lru_cache(maxsize=1)
def _plan(columns: int, rows: int, seed: Seed) -> Array:
    """`latin`, once for all who ask for parts of the same one."""
    found = latin(columns, rows, seed)
    found.flags.writeable = False
    return found


class Points:
    """A design's points by their index: the same whichever range they are asked for in.

    One per thread, because a Sobol sequence keeps its place.

    Parameters
    ----------
    method : {"random", "lhs", "sobol"}
        Independent points, a Latin hypercube (kept in memory, shared by all threads), or a
        scrambled Sobol sequence (balanced for powers of two).
    columns, rows : int
        Dimensions and points in all.
    seed : int
        Of the design, 0 or more.
    """

    def __init__(self, method: str, columns: int, rows: int, seed: int) -> None:
        self._columns, self._rows, self._seed = columns, rows, seed
        self._draw = {"random": self._random, "lhs": self._lhs, "sobol": self._sobol}[method]
        self._sequence: Any = None

    def at(self, first: int, count: int) -> Array:
        """Give the points `first` to `first + count - 1`.

        Parameters
        ----------
        first, count : int
            A range within the design's points.

        Returns
        -------
        ndarray, shape (count, columns)
            Numbers from 0 to 1.
        """
        return self._draw(first, count)

    def _random(self, first: int, count: int) -> Array:
        """Philox, set to the row's place."""
        steps = -(-self._columns // _WORDS)  # whole steps per row
        source = np.random.Philox(self._seed)
        source.advance(first * steps)
        drawn = np.random.Generator(source).random((count, steps * _WORDS))
        return drawn[:, : self._columns]

    def _lhs(self, first: int, count: int) -> Array:
        return _plan(self._columns, self._rows, self._seed)[first : first + count]

    def _sobol(self, first: int, count: int) -> Array:
        """Forward from where the last range ended."""
        from scipy.stats import qmc

        if self._sequence is None or self._sequence.num_generated > first:
            source = np.random.default_rng(self._seed)
            self._sequence = qmc.Sobol(self._columns, scramble=True, bits=_BITS, rng=source)
        with warnings.catch_warnings():  # its advice on powers of two is in the manual
            warnings.simplefilter("ignore", UserWarning)
            if first > self._sequence.num_generated:
                self._sequence.fast_forward(first - self._sequence.num_generated)
            return np.asarray(self._sequence.random(count))
