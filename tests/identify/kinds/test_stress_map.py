"""Strain over temperature at several loads: slopes, loads left out, the bench's wires."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import expit

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.kinds.stress import SHARES, Cycle, Way, cycle, fit, pieces, relative_error
from macromicro.plant import micro, wire
from macromicro.thesis import kiln_bench

HALF = int(np.abs(SHARES - 0.5).argmin())
LOADS = (50.0, 100.0, 150.0, 200.0, 250.0)


def loop(
    load: float, noise: float = 0.0, seed: int = 0, spread: float = 0.0
) -> tuple[Array, Array]:
    """Heating and cooling through the transformation; strain saturates with the load."""
    n = 1500
    t = np.concatenate([np.linspace(20.0, 150.0, n), np.linspace(150.0, 20.0, n)])
    up = np.arange(2 * n) < n
    middle = np.where(up, 80.0 + 0.15 * load, 55.0 + 0.12 * load)
    width = np.where(up, 4.0, 5.0) * (1.0 + spread * load)
    y = 4.0 * (1.0 - math.exp(-load / 60.0)) * expit((t - middle) / width) - 0.01 * load
    return t, y + noise * np.random.default_rng(seed).standard_normal(2 * n)


def cycles(loads: tuple[float, ...] = LOADS, **how: float) -> list[Cycle]:
    return [cycle(s, *loop(s, seed=k, **how)) for k, s in enumerate(loads)]  # type: ignore[arg-type]


def test_slopes_and_loads_left_out() -> None:
    found = fit(cycles(noise=0.002))
    assert found.way == Way(common=True, saturating=True)
    for side, slope, at_zero in ((found.heating, 0.15, 80.0), (found.cooling, 0.12, 55.0)):
        assert side.slopes[HALF] == pytest.approx(slope, abs=5.0 * side.spread[HALF])
        assert side.spread[HALF] < 1e-3 and side.rms < 0.3
        assert side.temperatures(0.0)[HALF] == pytest.approx(at_zero, abs=0.2)
    assert found.inside == (100.0, 150.0, 200.0)
    assert max(found.left_out[s] for s in found.inside) < 0.01
    assert found.within(50.0) and found.within(250.0)
    assert not found.within(49.9) and not found.within(250.1)
    unseen = cycle(125.0, *loop(125.0))
    assert relative_error(found, unseen) < 0.01


def test_a_stroke_may_saturate_from_the_hot_level() -> None:
    """The strain of the cold wire saturates, the hot one is elastic."""

    def made(load: float) -> Cycle:
        t, y = loop(load)
        return cycle(load, t, 4.0 * (1.0 - math.exp(-load / 60.0)) - y)

    found = fit([made(load) for load in (50.0, 100.0, 200.0, 250.0)])
    assert found.way.saturating and found.way.from_hot
    assert max(found.left_out[s] for s in found.inside) < 0.01
    assert relative_error(found, made(150.0)) < 0.01
    low, high = found.heating.levels(150.0)
    assert high == pytest.approx(1.5, abs=0.02)
    assert low - high == pytest.approx(4.0 * (1.0 - math.exp(-2.5)), abs=0.02)


def test_a_transformation_that_widens_has_a_slope_for_each_share() -> None:
    found = fit(cycles(spread=0.002))
    assert not found.way.common
    slopes = found.heating.slopes
    # T_q = 80 + 0.15 s + 4 (1 + 0.002 s) logit q
    for q in (0.1, 0.5, 0.9):
        k = int(np.abs(SHARES - q).argmin())
        want = 0.15 + 0.008 * math.log(SHARES[k] / (1.0 - SHARES[k]))
        assert slopes[k] == pytest.approx(want, abs=0.002)


def test_two_loads_are_a_line_without_errors() -> None:
    found = fit(cycles((50.0, 250.0)))
    assert found.way == Way(common=True, saturating=False)
    assert found.left_out == {} and found.inside == ()
    assert np.isnan(found.heating.spread).all()
    assert found.heating.slopes[HALF] == pytest.approx(0.15, abs=1e-3)
    low, high = found.heating.levels(150.0)
    ends = [found.heating.levels(s) for s in (50.0, 250.0)]
    assert (low, high) == pytest.approx(tuple(np.mean(ends, axis=0)))


def test_levels_beyond_the_last_loads_go_on_along_their_line() -> None:
    found = fit(cycles((50.0, 150.0)))
    a, b = (np.array(found.heating.levels(s)) for s in (50.0, 150.0))
    np.testing.assert_allclose(found.heating.levels(350.0), a + 3.0 * (b - a))
    np.testing.assert_allclose(found.heating.levels(0.0), a - 0.5 * (b - a))


def test_the_bench_s_own_wires_follow_clausius_and_clapeyron() -> None:
    """Tempered slowly under five weights: the slope is `shift`, which nothing here reads."""
    own, table = wire.Wire(), kiln_bench.prepare(kiln_bench.KilnBench()).table
    own = own._replace(austenite=own.martensite)  # else half of the way is not half transformed
    way = np.concatenate([np.linspace(20.0, 160.0, 700), np.linspace(160.0, 20.0, 700)])
    kept = []
    for grams in (20.0, 40.0, 60.0, 80.0, 100.0):
        load = wire.Load(grams * 9.80665e-3, 0.0, 0.0)
        s = micro.cold_wire(own, load, table, 20.0)
        x = []
        for t in way:
            s = wire.tempered(own, load, table, s, float(t))
            x.append(s.x)
        kept.append(cycle(load.preload, way, np.array(x)))
    found = fit(kept)
    for side in (found.heating, found.cooling):
        assert side.slopes[HALF] == pytest.approx(own.shift, rel=0.01)
    assert max(found.left_out[s] for s in found.inside) < 0.01


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0.5, 30.0), min_size=2, max_size=6))
def test_pieces_cover_a_way_once(steps: list[float]) -> None:
    ends = np.cumsum([0.0, *(s * (-1) ** k for k, s in enumerate(steps))])
    way = np.concatenate([np.linspace(a, b, 30) for a, b in pairwise(ends)])
    found = pieces(way)
    assert [a for a, _, _ in found] == [0, *(b for _, b, _ in found[:-1])]
    assert found[-1][1] == len(way)
    for a, b, rising in found:
        assert bool(way[b - 1] > way[a]) is rising


def test_minor_branches_are_left_out() -> None:
    t, y = loop(100.0)
    half = len(t) // 2
    small = slice(half, half + 400)  # cools a third of the way, and heats again
    there = np.concatenate([t[:half], t[small], t[small][::-1], t[half:]])
    wrong = np.sin(np.linspace(0.0, np.pi, 800))  # nothing at its ends, where branches meet
    way = np.concatenate([y[small], y[small][::-1]]) - wrong
    output = np.concatenate([y[:half], way, y[half:]])
    plain, with_minor = cycle(100.0, t, y), cycle(100.0, there, output)
    np.testing.assert_allclose(
        with_minor.heating.temperatures, plain.heating.temperatures, atol=0.1
    )


def test_refused() -> None:
    t, y = loop(100.0)
    with pytest.raises(InputError, match="no complete cooling"):
        cycle(100.0, t[:1500], y[:1500])
    with pytest.raises(InputError, match="an output that changes"):
        cycle(100.0, t, 0.0 * y)
    with pytest.raises(InputError, match="two or more"):
        fit(cycles((50.0,)))
    with pytest.raises(InputError, match="each once"):
        fit(cycles((50.0, 50.0)))
