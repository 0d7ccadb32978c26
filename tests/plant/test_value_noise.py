"""Random functions without a state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.kernel import compiled
from macromicro.plant import value_noise


def test_nodes_are_random_numbers_of_mean_0_and_deviation_1() -> None:
    """Uniform ones: mean, deviation, quarters; neighbours and other functions are independent."""
    for seed in (0.0, 1.0, 17.0):
        x = np.array([value_noise.node(seed, float(k)) for k in range(-1000, 9000)])
        assert abs(x.mean()) < 0.03 and x.std() == pytest.approx(1.0, abs=0.02)
        shares = np.histogram(x, bins=4, range=(-math.sqrt(3.0), math.sqrt(3.0)))[0] / len(x)
        assert shares == pytest.approx([0.25] * 4, abs=0.02)
        others = [x[1:], x[2:], x[7:]]
        assert all(abs(np.corrcoef(x[: len(o)], o)[0, 1]) < 0.05 for o in others)
    a, b = (np.array([value_noise.node(s, float(k)) for k in range(4000)]) for s in (0.0, 1.0))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.05


@given(st.floats(0.0, 1000.0), st.integers(-10_000, 10_000), st.floats(0.0, 1.0))
def test_a_cubic_joins_the_nodes(seed: float, k: int, r: float) -> None:
    low, high = value_noise.node(seed, float(k)), value_noise.node(seed, k + 1.0)
    found = value_noise.at(seed, k + r)
    assert found == pytest.approx(low + r * r * (3.0 - 2.0 * r) * (high - low), abs=1e-9)
    assert min(low, high) - 1e-12 <= found <= max(low, high) + 1e-12


def test_compiled_it_is_the_same() -> None:
    for s in (-3.2, 0.0, 7.75, 12345.6):
        assert compiled(value_noise.at)(2.0, s) == value_noise.at(2.0, s)
