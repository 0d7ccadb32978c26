"""Records in counts (`macromicro.identify._counts`)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.arrays import Array
from macromicro.identify import _counts, coverage

STEPS = st.floats(1e-6, 1e3)


@given(STEPS, st.floats(-0.5, 0.5), st.integers(0, 99))
def test_the_step_of_a_record_is_found_wherever_its_counts_lie(
    step: float, shift: float, seed: int
) -> None:
    k = np.random.default_rng(seed).integers(-500, 500, 200)
    k[:2] = 0, 1
    assert _counts.pitch((k + shift) * step) == pytest.approx(step, rel=1e-6)


def test_values_of_no_step_have_none() -> None:
    assert _counts.pitch(np.random.default_rng(0).standard_normal(500)) is None
    assert _counts.pitch(np.sqrt(np.arange(400.0))) is None
    assert _counts.pitch([1.0, 1.0, 2.0]) is None  # one step shows no rule


def test_what_is_smaller_than_rounding_is_rounding() -> None:
    clean, step = np.linspace(0.0, 30.0, 4001), 2.0
    random = np.random.default_rng(1)
    own = _counts.noise(clean, step * step / 12.0, step, random)
    assert np.abs(own).max() <= 0.5 * step * (1.0 + 1e-9)
    assert _counts.pitch(clean + own) == pytest.approx(step)
    assert np.var(own) == pytest.approx(step * step / 12.0, rel=0.02)
    more = _counts.noise(clean, step * step, step, random)
    assert np.std(more) == pytest.approx(step, rel=0.05)
    assert np.abs(more).max() > step
    assert np.std(_counts.noise(clean, 0.25, None, random)) == pytest.approx(0.5, rel=0.05)


def _told(slopes: Array, runs: list[Array], step: float, *, zeroed: bool = False) -> Array:
    """Covariance by rounding alone."""
    solve, steps = np.linalg.pinv(slopes), [step] * len(runs)
    return _counts.redrawn(solve.__matmul__, slopes, runs, steps, zeroed=zeroed).covariance


def test_a_step_is_felt_where_noise_is_no_more_than_rounding() -> None:
    x = np.round(np.linspace(0.0, 30.0, 400) / 0.5) * 0.5
    assert _counts.felt(x, 0.5**2 / 12.0) == pytest.approx(0.5)
    assert _counts.felt(x, 0.5**2) is None
    assert _counts.felt(np.sqrt(np.arange(400.0)), 0.0) is None


def test_a_covariance_by_rounding_is_the_scatter_of_fits_to_rounded_curves() -> None:
    # Slow curves over few counts, whose rounding is far from white.
    t = np.linspace(0.0, 1.0, 2000)
    table, step = np.column_stack([t, np.exp(-3.0 * t)]), 0.25
    solve, random, off = np.linalg.pinv(table), np.random.default_rng(2), []
    truths = np.array([0.4, 1.0]) + random.uniform(-0.2, 0.2, (2000, 2))
    for truth, at in zip(truths, random.uniform(size=2000), strict=True):
        off.append(solve @ (np.floor(table @ truth / step + at) * step) - truth)
    twice = np.vstack([table, table])
    told = np.mean([_told(table, [table @ truth], step) for truth in truths[::50]], axis=0)
    half = np.mean([_told(twice, [table @ truth] * 2, step) for truth in truths[::50]], axis=0)
    scatter = np.array(off)
    assert np.diag(told) == pytest.approx(np.mean(scatter**2, axis=0), rel=0.08)
    assert told[0, 1] == pytest.approx(np.mean(scatter[:, 0] * scatter[:, 1]), rel=0.08)
    # Of two records that say the same, each with counts of its own, the mean is half as unsure.
    assert np.diag(half) == pytest.approx(0.5 * np.diag(told), rel=0.08)


def test_what_rounding_explains() -> None:
    clean, step = np.linspace(0.0, 7.0, 3000), 0.5
    for at in (0.0, 0.3, 0.99):
        left = np.floor(clean / step + at) * step - clean
        assert _counts.explains(left, step)
        assert _counts.explains(np.r_[left, np.nan], step)
        assert not _counts.explains(left * 1.3, step)
        assert not _counts.explains(left + step * np.sin(clean), step)
    assert not _counts.explains(np.full(100, step), step)


def test_a_step_is_told_of_each_record_or_of_none() -> None:
    t = np.linspace(0.0, 1.0, 500)
    run, step = 3.0 * t, 0.1
    y = np.round(run / step) * step
    assert _counts.steps([y, 2.0 * y], [y - run, 2.0 * (y - run)]) == pytest.approx([0.1, 0.2])
    assert _counts.steps([y, y], [y - run, y - run + 0.1 * np.sin(9.0 * t)]) is None
    assert _counts.steps([y, np.sqrt(t)], [y - run, np.zeros(500)]) is None


def test_a_force_that_moves_the_output_by_less_than_a_count_shows_in_its_counts() -> None:
    """Its residual has the size of rounding, its parameters are off by more."""
    t, step = np.linspace(0.0, 1.0, 4000), 0.1
    slopes = np.column_stack([t, np.sin(9.0 * t)])
    solve = np.linalg.pinv(slopes)

    def alone(y: Array, zeroed: bool) -> bool:
        run = slopes @ (solve @ y)
        assert _counts.explains(y - run, step)
        told = _told(slopes, [run], step, zeroed=zeroed)
        return _counts.alone(slopes, told, [y], [run], [step], zeroed=zeroed)

    for seed in range(20):
        random = np.random.default_rng(seed)
        clean = slopes @ random.uniform(3.0, 6.0, 2)
        at = random.uniform()
        assert alone(np.floor(clean / step + at) * step, False)
        assert alone((np.floor(clean / step + at) - at + 0.5) * step, True)
        pushed = clean + 0.25 * step * np.sin(31.0 * t)
        y = (np.floor(pushed / step + at) - at + 0.5) * step
        assert not alone(y, True)
    # Samples that are not there say nothing.
    run = slopes @ (solve @ y)
    told = _told(slopes, [run], step, zeroed=True)
    y[5], run[7] = np.nan, np.nan
    assert not _counts.alone(slopes, told, [y], [run], [step], zeroed=True)
    every = np.full_like(y, np.nan)
    every[:3] = y[:3]
    assert _counts.alone(slopes, told, [every], [run], [step], zeroed=True)


def test_a_known_zero_leaves_the_offset_to_what_rounding_averages() -> None:
    """Unknown within a count, it is 0.29 of a count off (a uniform distribution)."""
    t, step = np.linspace(0.0, 7.0, 3000), 0.1
    slopes = np.column_stack([np.ones(3000), t])
    unknown = _told(slopes, [slopes @ [0.2, 1.0]], step)
    known = _told(slopes, [slopes @ [0.2, 1.0]], step, zeroed=True)
    assert np.sqrt(unknown[0, 0]) == pytest.approx(step / np.sqrt(12.0), rel=0.01)
    assert np.sqrt(known[0, 0]) < 0.02 * step
    assert known[1, 1] == pytest.approx(unknown[1, 1], rel=0.05)  # of other curves


def test_zeros_of_several_records_are_even_in_each_and_by_chance_together() -> None:
    places = _counts.places(3, 50)
    even = (np.arange(50) + 0.5) / 50
    assert np.sort(places, axis=0) == pytest.approx(np.repeat(even[:, None], 3, axis=1))
    together = np.corrcoef(places.T)
    assert np.abs(together[np.triu_indices(3, 1)]).max() < 0.5
    assert places.tolist() == _counts.places(3, 50).tolist()


def test_errors_of_two_records_scatter_as_their_sum() -> None:
    """Half the sum of two rectangles' errors is a triangle: 95 % within 1.9 standard errors."""
    run, back = np.full(50, 0.37), np.full((1, 50), 0.02)
    one = _counts.redrawn(back.__matmul__, np.zeros((50, 1)), [run], [1.0], zeroed=True)
    two = np.hstack([back, back])
    both = _counts.redrawn(two.__matmul__, np.zeros((100, 1)), [run, run], [1.0, 1.0], zeroed=True)
    held = [coverage.factors(d.draws, np.eye(1))[1, 0] for d in (one, both)]
    assert held[0] == pytest.approx(np.sqrt(3.0) * 0.95, rel=0.02)
    assert held[1] == pytest.approx(np.sqrt(6.0) * (1.0 - np.sqrt(0.05)), rel=0.05)
    assert both.covariance == pytest.approx(2.0 * one.covariance, rel=0.1)


def test_errors_are_drawn_of_the_curves_that_they_leave_open() -> None:
    """A gain by a few held levels: intervals about the curve that was found are too narrow, for it
    lies best among the counts; those of the curves that errors leave open hold more."""
    once, twice = [], []
    for seed in range(100):
        random = np.random.default_rng(seed)
        slopes = np.repeat(random.uniform(-2.0, 2.0, 6), 5)[:, None]
        solve = np.linalg.pinv(slopes)
        found = solve @ np.floor(slopes @ [3.0] + random.uniform())
        off, run = abs(float(found[0]) - 3.0), slopes @ found
        still = np.zeros_like(slopes)  # as if no error moved the curve
        first = _counts.redrawn(solve.__matmul__, still, [run], [1.0]).covariance[0, 0]
        told = _counts.redrawn(solve.__matmul__, slopes, [run], [1.0])
        once.append(off < 1.96 * np.sqrt(first))
        twice.append(off < 1.96 * np.sqrt(told.covariance[0, 0]))
        assert np.mean(told.draws**2) == pytest.approx(told.covariance[0, 0])
    assert np.mean(twice) > 0.88 and np.mean(twice) > np.mean(once) + 0.04
