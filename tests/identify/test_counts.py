"""Records in counts (`macromicro.identify._counts`)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.arrays import Array
from macromicro.identify import _counts

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
        y = (np.floor(table @ truth / step + at) - at + 0.5) * step
        off.append(solve @ y - truth)
    twice = np.vstack([table, table])
    some = truths[::50]
    own = np.mean([_counts.covariance(table, [table @ p], [step]) for p in some], axis=0)
    half = np.mean([_counts.covariance(twice, [table @ p] * 2, [step] * 2) for p in some], axis=0)
    scatter = np.array(off)
    assert np.diag(own) == pytest.approx(np.mean(scatter**2, axis=0), rel=0.08)
    assert own[0, 1] == pytest.approx(np.mean(scatter[:, 0] * scatter[:, 1]), rel=0.08)
    # Of two records that say the same, each with counts of its own, the mean is half as unsure.
    assert np.diag(half) == pytest.approx(0.5 * np.diag(own), rel=0.08)


def test_what_rounding_explains() -> None:
    clean, step = np.linspace(0.0, 7.0, 3000), 0.5
    for at in (0.0, 0.3, 0.99):
        left = np.floor(clean / step + at) * step - clean
        assert _counts.explains(left, step)
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

    def alone(y: Array) -> bool:
        run = slopes @ (solve @ y)
        assert _counts.explains(y - run, step)
        own = _counts.covariance(slopes, [run], [step])
        return _counts.alone(slopes, own, [y], [run], [step])

    for seed in range(20):
        random = np.random.default_rng(seed)
        clean = slopes @ random.uniform(3.0, 6.0, 2)
        at = random.uniform()
        assert alone((np.floor(clean / step + at) - at + 0.5) * step)
        pushed = clean + 0.25 * step * np.sin(31.0 * t)
        assert not alone((np.floor(pushed / step + at) - at + 0.5) * step)


def test_zeros_of_several_records_are_even_in_each_and_by_chance_together() -> None:
    places = _counts.places(3, 50)
    even = (np.arange(50) + 0.5) / 50
    assert np.sort(places, axis=0) == pytest.approx(np.repeat(even[:, None], 3, axis=1))
    together = np.corrcoef(places.T)
    assert np.abs(together[np.triu_indices(3, 1)]).max() < 0.5
    assert places.tolist() == _counts.places(3, 50).tolist()
