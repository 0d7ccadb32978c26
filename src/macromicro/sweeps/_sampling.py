"""From a variant's index to its parameters.

Every method gives the same values for an index in any range, so that workers need only
indices and a resumed sweep only its spec.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from macromicro.arrays import Array
from macromicro.sampling import Points
from macromicro.sweeps._spec import Spec

if TYPE_CHECKING:
    from macromicro.batch import Variants


class Sampler:
    """The variants of a spec, by range of indices; one per thread."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.paths = tuple(axis.path for axis in spec.axes)
        self._points = (
            None
            if spec.method == "grid"
            else Points(spec.method, len(spec.axes), spec.variants, spec.seed)
        )

    def values(self, first: int, count: int) -> Array:
        """The parameters of the variants `first` to `first + count - 1`."""
        spec = self.spec
        if not 0 <= first <= first + count <= spec.variants:
            raise IndexError(f"{first} to {first + count} of {spec.variants} variants")
        if self._points is None:
            return self._grid(first, count)
        shares = self._points.at(first, count)
        columns = [axis.at(shares[:, k]) for k, axis in enumerate(spec.axes)]
        return np.ascontiguousarray(np.stack(columns, axis=1))

    def variants(self, first: int, count: int) -> Variants:
        from macromicro.batch import Variants

        return Variants(self.paths, self.values(first, count))

    def _grid(self, first: int, count: int) -> Array:
        """All combinations, the last parameter fastest."""
        levels = [np.asarray(axis.levels) for axis in self.spec.axes]
        places = np.unravel_index(np.arange(first, first + count), [len(each) for each in levels])
        found: Array = np.stack([a[k] for a, k in zip(levels, places, strict=True)], axis=1)
        return found
