"""From a variant's index to its parameters, without a plan in memory.

Every method gives the same values for an index whichever range it is asked in, so that
workers need only indices, and a sweep that goes on needs nothing but its spec.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from macromicro.sweep.spec import Spec

if TYPE_CHECKING:
    from macromicro.batch import Variants

Array = npt.NDArray[np.float64]
Words = npt.NDArray[np.uint64]

_ROUNDS = 6  # of the permutation's network; four suffice for pseudo-randomness
_BITS = 32  # of Sobol points; scipy goes forward in no more
_WORDS = 4  # numbers that Philox gives per step


class Sampler:
    """The variants of a spec, by range of indices. One per thread: Sobol keeps its place."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.paths = tuple(axis.path for axis in spec.axes)
        self._points: Any = None

    def values(self, first: int, count: int) -> Array:
        """Parameters of the variants `first` to `first + count - 1`; (count, parameters)."""
        spec = self.spec
        if not 0 <= first <= first + count <= spec.variants:
            raise IndexError(f"{first} to {first + count} of {spec.variants} variants")
        if spec.method == "grid":
            return self._grid(first, count)
        shares = getattr(self, f"_{spec.method}")(first, count)
        columns = [axis.at(shares[:, k]) for k, axis in enumerate(spec.axes)]
        return np.ascontiguousarray(np.stack(columns, axis=1))

    def variants(self, first: int, count: int) -> Variants:
        """The same as a batch takes it."""
        from macromicro.batch import Variants

        return Variants(self.paths, self.values(first, count))

    def _grid(self, first: int, count: int) -> Array:
        """All combinations, the last parameter quickest."""
        index = np.arange(first, first + count, dtype=np.int64)
        found = np.empty((count, len(self.paths)))
        for k in reversed(range(len(self.paths))):
            levels = np.asarray(self.spec.axes[k].levels)
            index, place = np.divmod(index, len(levels))
            found[:, k] = levels[place]
        return found

    def _random(self, first: int, count: int) -> Array:
        """Independent numbers from 0 to below 1: Philox, set to the row's place."""
        width = len(self.paths)
        steps = -(-width // _WORDS)  # whole steps per row
        source = np.random.Philox(key=self.spec.seed)
        source.advance(first * steps)
        drawn = np.random.Generator(source).random((count, steps * _WORDS))
        return drawn[:, :width]

    def _lhs(self, first: int, count: int) -> Array:
        """Latin hypercube: in every column each of the `spec.variants` strata once.

        A column's strata are a keyed permutation of the indices, computed number by number
        (a plan in memory, as scipy.stats.qmc.LatinHypercube makes, grows with the sweep).
        """
        index = np.arange(first, first + count, dtype=np.uint64)
        source = np.random.SeedSequence(self.spec.seed)
        words = source.generate_state(_ROUNDS * len(self.paths), np.uint64)
        keys: Words = words.astype(np.uint64)
        inside = self._random(first, count)
        for k in range(len(self.paths)):
            own = keys[k * _ROUNDS : (k + 1) * _ROUNDS]
            inside[:, k] += permuted(index, self.spec.variants, own)
        # The last stratum's points may round up to 1.
        below = np.nextafter(1.0, 0.0)
        return np.asarray(np.minimum(inside / self.spec.variants, below))

    def _sobol(self, first: int, count: int) -> Array:
        """Scrambled Sobol points; forward from where the last range ended."""
        from scipy.stats import qmc

        if self._points is None or self._points.num_generated > first:
            source = np.random.default_rng(self.spec.seed)
            self._points = qmc.Sobol(len(self.paths), scramble=True, bits=_BITS, seed=source)
        with warnings.catch_warnings():  # its advice on powers of two is in the manual
            warnings.simplefilter("ignore", UserWarning)
            if first > self._points.num_generated:
                self._points.fast_forward(first - self._points.num_generated)
            return np.asarray(self._points.random(count))


def permuted(index: Words, size: int, keys: Words) -> Words:
    """A permutation of 0 to `size` - 1 that `keys` decide, of these numbers of it.

    A balanced Feistel network over the smallest even number of bits that holds `size`; what
    falls outside goes through again until it is inside (cycle walking), which keeps it a
    permutation. Less than four passes on average.
    """
    half = max(1, ((size - 1).bit_length() + 1) // 2)
    mask, shift = np.uint64((1 << half) - 1), np.uint64(half)
    found = index.copy()
    open_ = np.arange(len(found))
    while len(open_):
        left, right = found[open_] >> shift, found[open_] & mask
        for key in keys:
            left, right = right, left ^ (_mixed(right ^ key) & mask)
        found[open_] = (left << shift) | right
        open_ = open_[found[open_] >= size]
    return found


def _mixed(words: Words) -> Words:
    """Every bit of the 64 depends on every bit (the finaliser of SplitMix64)."""
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
