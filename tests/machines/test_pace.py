"""How many control periods make one of the live machine."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.machines import pace


def tree(period: float) -> Any:
    return SimpleNamespace(timing=SimpleNamespace(period=period))


@pytest.mark.parametrize(
    ("period", "number"),
    [(1e-5, 100), (1e-4, 10), (0.2e-3, 5), (0.25e-3, 4), (0.3e-3, 4), (0.7e-3, 2), (1e-3, 1),
     (1.5e-3, 1), (2e-3, 1), (0.1, 1), (20 * 1e-6 - 4e-21, 50)],
)  # fmt: skip
def test_as_few_as_last_a_millisecond(period: float, number: int) -> None:
    assert pace.periods(tree(period)) == number
    assert pace.period(tree(period)) == number * period


@given(st.floats(1e-5, 0.1))
def test_it_is_no_shorter_than_the_shortest_and_less_than_a_period_longer(period: float) -> None:
    found = pace.period(tree(period))
    assert found >= 1e-3 * (1.0 - 1e-6)
    assert found == period or found < 1e-3 + period
