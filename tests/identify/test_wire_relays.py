"""Relays whose thresholds scatter by two bell curves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.hysteresis import advance, fresh
from macromicro.identify.wire_model import Branch, below, hysteresis, quantile, relays

UP, DOWN = Branch(80.0, 3.0, 0.6), Branch(60.0, 4.0, 1.5)
SKEWS = st.floats(0.2, 5.0)


def test_a_symmetric_one_is_the_logistic_curve() -> None:
    u = np.array([60.0, 78.0, 80.0, 95.0])
    assert below(Branch(80.0, 3.0), u) == pytest.approx(1.0 / (1.0 + np.exp(-(u - 80.0) / 3.0)))


@given(st.floats(0.01, 0.99), st.floats(0.5, 20.0), SKEWS)
def test_a_quantile_has_its_share_below_it(share: float, spread: float, skew: float) -> None:
    p = Branch(70.0, spread, skew)
    assert below(p, [quantile(p, share)])[0] == pytest.approx(share, rel=1e-9)


def test_less_skew_has_the_longer_tail_below() -> None:
    def tails(p: Branch) -> tuple[float, float]:
        return quantile(p, 0.5) - quantile(p, 0.05), quantile(p, 0.95) - quantile(p, 0.5)

    low, high = tails(UP)
    assert low > 1.25 * high
    low, high = tails(DOWN)
    assert high > low


def test_the_table_counts_the_relays_between_two_temperatures() -> None:
    table = relays(UP, DOWN, 0.3, 2.0)
    n = len(table.values)
    grid = table.lo + table.step * np.arange(n)
    p, q = np.diff(below(UP, grid)), np.diff(below(DOWN, grid))

    def counted(i: int, j: int) -> float:
        pairs = [(a, b) for a in range(j, i) for b in range(j, a + 1)]
        return sum(p[a] * q[b] * (0.5 if a == b else 1.0) for a, b in pairs)

    whole = counted(n - 1, 0)
    for i, j in ((n - 1, 0), (40, 10), (45, 44), (30, 0), (n - 1, 30)):
        assert table.values[i, j] == pytest.approx(2.0 * counted(i, j) / whole, rel=1e-9)
    assert table.f_low == 0.3
    assert table.span == pytest.approx(2.0)


@settings(max_examples=20, deadline=None)
@given(st.floats(-20.0, 40.0), SKEWS, SKEWS)
def test_every_density_is_nonnegative_and_its_loop_closes(apart: float, up: float, down: float):
    one = Branch(80.0, 3.0, up)
    table = relays(one, Branch(80.0 - apart, 4.0, down), 0.0, 1.0)
    cells = np.diff(np.diff(table.values, axis=0), axis=1)
    assert cells[np.tril_indices(len(cells), -1)].max() <= 1e-12  # E falls as m rises
    h = hysteresis(table)
    memory, x = fresh(h.table, 0.0), -1.0
    seen = []
    for u in (200.0, -100.0, 200.0):
        memory, x = advance(h.table, memory, u)
        seen.append(x)
    assert seen == pytest.approx([1.0, 0.0, 1.0], abs=1e-9)
