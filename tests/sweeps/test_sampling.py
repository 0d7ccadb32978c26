"""Laws of the sampling: an index alone decides its variant, and each method keeps its promise."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.sweeps._axis import Axis
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import Spec

AXES = (
    Axis("a", "N", (), -2.0, 3.0),
    Axis("b", "m", (), 1e-3, 1e3, "log"),
    Axis("c", "", (1.0, 2.0, 5.0)),
    Axis("d", "kg", (7.0,)),
    Axis("e", "", (), 5.0, 5.5),
)
SAMPLED = ("random", "lhs", "sobol")


def spec(method: str, count: int, seed: int = 0, axes: tuple[Axis, ...] = AXES) -> Spec:
    return Spec("fake", (), method, seed, ("m",), (0,), axes, count)


@st.composite
def cuts(draw: st.DrawFn) -> tuple[int, list[tuple[int, int]]]:
    """A number of variants, and ranges of them in any order."""
    count = draw(st.integers(1, 300))
    ends = st.integers(0, count)
    pairs = draw(st.lists(st.tuples(ends, ends), min_size=1, max_size=6))
    return count, [(min(p), max(p)) for p in pairs]


@given(cuts(), st.sampled_from(SAMPLED), st.integers(0, 2**63 - 1))
def test_an_index_decides_its_variant(
    plan: tuple[int, list[tuple[int, int]]], method: str, seed: int
) -> None:
    """Whichever ranges are asked for, in whatever order, by one sampler or by several."""
    count, ranges = plan
    whole = Sampler(spec(method, count, seed)).values(0, count)
    sampler = Sampler(spec(method, count, seed))
    for low, high in ranges:
        assert np.array_equal(sampler.values(low, high - low), whole[low:high])


@given(st.sampled_from(SAMPLED), st.integers(1, 300), st.integers(0, 1000))
def test_values_lie_in_their_bounds(method: str, count: int, seed: int) -> None:
    values = Sampler(spec(method, count, seed)).values(0, count)
    assert values.shape == (count, len(AXES))
    for k, axis in enumerate(AXES):
        if axis.levels:
            assert set(values[:, k]) <= set(axis.levels)
        else:
            assert axis.low <= values[:, k].min() and values[:, k].max() <= axis.high


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.data())
def test_a_grid_has_every_combination_once(sizes: list[int], data: st.DataObject) -> None:
    """The last parameter changes quickest, whatever part is asked for."""
    axes = tuple(
        Axis(f"p{k}", "", tuple(float(10 * k + i) for i in range(n))) for k, n in enumerate(sizes)
    )
    count = int(np.prod(sizes))
    sampler = Sampler(spec("grid", count, axes=axes))
    expected = list(itertools.product(*(axis.levels for axis in axes)))
    assert list(map(tuple, sampler.values(0, count).tolist())) == expected
    low = data.draw(st.integers(0, count - 1))
    assert list(map(tuple, sampler.values(low, count - low).tolist())) == expected[low:]


@given(st.integers(1, 500), st.integers(0, 1000))
def test_latin_hypercube_has_each_stratum_once(count: int, seed: int) -> None:
    axes = tuple(Axis(n, "", (), 0.0, 1.0) for n in "abc")
    values = Sampler(spec("lhs", count, seed, axes)).values(0, count)
    for column in values.T:
        assert sorted(np.floor(column * count).astype(int)) == list(range(count))


@pytest.mark.parametrize("method", SAMPLED)
def test_seeds_differ(method: str) -> None:
    first, second = (Sampler(spec(method, 50, s)).values(0, 50) for s in (1, 2))
    assert not np.array_equal(first, second)


@pytest.mark.parametrize("method", ["random", "sobol", "grid"])
def test_a_range_far_out_of_a_billion_needs_no_plan(method: str) -> None:
    """Only Sobol goes there point by point. A Latin hypercube is kept in memory."""
    axes = tuple(Axis(n, "", tuple(map(float, range(1000)))) for n in "abc")
    axes = axes if method == "grid" else AXES
    count = 10**9 if method != "sobol" else 2**24
    values = Sampler(spec(method, count, 1, axes)).values(count - 5, 5)
    assert values.shape == (5, len(axes))
    if method == "grid":
        assert values[-1].tolist() == [999.0, 999.0, 999.0]


def test_beyond_the_sweep_is_refused() -> None:
    with pytest.raises(IndexError, match="8 to 11 of 10"):
        Sampler(spec("random", 10)).values(8, 3)


def test_log_scale_is_even_in_the_logarithm() -> None:
    """Of a Latin hypercube over three decades a third of the points lie in each."""
    axes = (Axis("a", "", (), 1.0, 1000.0, "log"),)
    values = Sampler(spec("lhs", 300, 0, axes)).values(0, 300)[:, 0]
    assert [int(((10.0**k <= values) & (values < 10.0 ** (k + 1))).sum()) for k in range(3)] == [
        100,
        100,
        100,
    ]
