"""Ensembles of benches."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.schema.par import entries
from macromicro.settings import Settings
from macromicro.tuning._ensemble import draw, fresh
from macromicro.uncertainty import table


@pytest.mark.parametrize("stage", ["macro", "micro"])
def test_the_first_bench_is_the_one_that_is(stage: str) -> None:
    found = draw(stage, Settings(), 12, "worst", 5)
    paths, values = found.on_bench()
    known = {e.path: e for e in entries(Settings())}
    np.testing.assert_allclose(values[0], [known[p].value for p in paths])
    for path, column in zip(paths, values.T, strict=True):
        par = known[path].par
        assert np.all((column >= par.lo) & (column <= par.hi))


def test_draws_stay_within_their_ranges_and_repeat() -> None:
    found = draw("micro", Settings(), 40, "worst", 5)
    for spread, column in zip(table.of_stage("micro"), found.draws[1:].T, strict=True):
        width = spread.high - spread.low
        assert spread.low <= column.min() < spread.low + 0.05 * width
        assert spread.high - 0.05 * width < column.max() <= spread.high
    assert np.array_equal(found.draws, draw("micro", Settings(), 40, "worst", 5).draws)
    assert not np.array_equal(found.draws, draw("micro", Settings(), 40, "worst", 6).draws)


@pytest.mark.parametrize("stage", ["macro", "micro"])
def test_fresh_benches_are_others_of_the_same_kind(stage: str) -> None:
    """Neither the nominal bench nor a drawn one of this or the next seed is among them."""
    searched = draw(stage, Settings(), 40, "q95", 5)
    held_out = fresh(searched, 40)
    assert held_out.aggregate == "q95"
    for other in (
        searched,
        draw(stage, Settings(), 40, "q95", 6),
        fresh(searched._replace(seed=6), 40),
    ):
        assert not np.isin(held_out.draws, other.draws).any()
    for spread, column in zip(table.of_stage(stage), held_out.draws.T, strict=True):
        assert spread.low <= column.min() < column.max() <= spread.high
    assert np.array_equal(held_out.draws, fresh(searched, 40).draws)


def test_aggregation() -> None:
    costs = np.array([[1.0, 3.0, 2.0], [0.0, 0.0, 0.5]])
    worst, high = (draw("macro", Settings(), 3, how, 0).total(costs) for how in ("worst", "q95"))
    np.testing.assert_allclose(worst, [3.0, 0.5])
    np.testing.assert_allclose(high, [2.9, 0.45])


@pytest.mark.parametrize(("benches", "how"), [(1, "worst"), (0, "worst"), (10**6, "q95"), (5, "x")])
def test_bad_requests(benches: int, how: str) -> None:
    with pytest.raises(InputError, match=r"--benches|--aggregate"):
        draw("macro", Settings(), benches, how, 0)
