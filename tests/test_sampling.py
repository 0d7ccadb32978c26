"""Points of the unit cube; what holds for ranges of them is in tests/sweeps/test_sampling.py."""

from __future__ import annotations

import numpy as np
import scipy
from scipy.stats import qmc

from macromicro.sampling import METHODS, Points, drawn_by, latin


def test_latin_hypercube() -> None:
    """Each column has one value in each of its strata, and a stream is a seed of its own."""
    drawn = latin(3, 50, seed=4)
    for column in drawn.T:
        assert sorted(np.floor(50.0 * column).astype(int)) == list(range(50))
    assert np.array_equal(drawn, latin(3, 50, 4))
    assert not np.isin(drawn, latin(3, 50, (4, 1))).any()


def test_designs_are_scipys() -> None:
    """A sweep's points can be drawn again without this package."""
    own = qmc.LatinHypercube(3, rng=np.random.default_rng(9)).random(40)
    assert np.array_equal(Points("lhs", 3, 40, 9).at(10, 20), own[10:30])
    own = qmc.Sobol(3, rng=np.random.default_rng(9), bits=32).random(64)
    assert np.array_equal(Points("sobol", 3, 64, 9).at(10, 20), own[10:30])


def test_what_drew_them_is_named() -> None:
    assert drawn_by() == f"scipy {scipy.__version__}"


def test_methods_share_no_points() -> None:
    drawn = [Points(method, 2, 16, 0).at(0, 16) for method in METHODS]
    assert len({float(d[0, 0]) for d in drawn}) == len(METHODS)
