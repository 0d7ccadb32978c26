"""Slopes of free runs over pieces, whose starts follow the parameters."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify._axis_pieces import Pieces, cut, settled
from macromicro.identify._axis_slopes import slopes
from macromicro.identify.axis import Axis, simulate
from macromicro.identify.axis_inverse import differences
from macromicro.identify.runs import Run

DT = 2e-3
T = np.arange(3000) * DT
TRUTH = Axis(2.0, 3.0, 1.5, 0.4)
FORCE = 9.0 * np.sin(3.0 * T) + 3.0 * np.sin(11.0 * T)


def pieces(free: bool, length: int) -> Pieces:
    x = simulate(TRUTH, FORCE, DT, 0.3) + 1e-5 * np.random.default_rng(1).normal(size=3000)
    return cut([differences(Run(T, FORCE, x), FORCE, 40.0, 4)], length, free)[0]


@pytest.mark.parametrize("free", [True, False])
def test_slopes_are_those_of_errors_whose_starts_follow(free: bool) -> None:
    """By differences of the whole thing, each start found anew."""
    made = [pieces(free, 700), pieces(free, 1200)]
    at = np.array([2.0, 3.0, 1.5])

    def model(z: np.ndarray) -> Axis:
        return Axis(*z.tolist(), 0.4)

    far = np.full(3, np.inf)
    found = slopes(made, model, at, 1e-3 * at, (-far, far))
    for k in range(3):
        up, down = at.copy(), at.copy()
        up[k], down[k] = 1.001 * at[k], 0.999 * at[k]
        errors = [np.concatenate([settled(p, model(z)).error for p in made]) for z in (up, down)]
        whole = (errors[0] - errors[1]) / (0.002 * at[k])
        miss = np.abs(np.delete(found[:, k] - whole, [0, 3000]))  # these records begin at rest
        assert miss.max() < 0.03 * np.abs(whole).max()
    # A bound halves the way.
    low = np.array([2.0, -np.inf, -np.inf])
    near = slopes(made, model, at, 1e-3 * at, (low, far))
    np.testing.assert_array_equal(near[:, 1:], found[:, 1:])
    assert (near[:, 0] != found[:, 0]).any()
