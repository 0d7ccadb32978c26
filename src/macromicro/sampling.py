"""Points of the unit cube from a seed: random, a Latin hypercube, Sobol's by scipy."""

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
    """The library that draws the points, with its version."""
    return f"scipy {importlib.metadata.version('scipy')}"


def latin(columns: int, rows: int, seed: int | Sequence[int]) -> Array:
    """A Latin hypercube: in every column one point in each of `rows` equal parts."""
    # As by scipy's `qmc.LatinHypercube`, whose import takes longer than a small study.
    (rng,) = np.random.default_rng(seed).spawn(1)
    within = rng.uniform(size=(rows, columns))
    parts = np.tile(np.arange(1, rows + 1), (columns, 1))
    for column in parts:
        rng.shuffle(column)
    return (parts.T - within) / rows


def scale(share: Array, low: float, high: float, *, log: bool = False) -> Array:
    return low * (high / low) ** share if log else low + (high - low) * share


@lru_cache(maxsize=1)
def _plan(columns: int, rows: int, seed: Seed) -> Array:
    """`latin`, cached for all parts of a design."""
    found = latin(columns, rows, seed)
    found.flags.writeable = False
    return found


class Points:
    """A design's points by index; one object per thread, as a Sobol sequence has state."""

    def __init__(self, method: str, columns: int, rows: int, seed: int) -> None:
        self._columns, self._rows, self._seed = columns, rows, seed
        self._draw = {"random": self._random, "lhs": self._lhs, "sobol": self._sobol}[method]
        self._sequence: Any = None

    def at(self, first: int, count: int) -> Array:
        """Points `first` to `first + count - 1`."""
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
        """Continue from the end of the last range."""
        from scipy.stats import qmc

        if self._sequence is None or self._sequence.num_generated > first:
            source = np.random.default_rng(self._seed)
            self._sequence = qmc.Sobol(self._columns, scramble=True, bits=_BITS, rng=source)
        with warnings.catch_warnings():  # its advice on powers of two is in the manual
            warnings.simplefilter("ignore", UserWarning)
            if first > self._sequence.num_generated:
                self._sequence.fast_forward(first - self._sequence.num_generated)
            return np.asarray(self._sequence.random(count))
