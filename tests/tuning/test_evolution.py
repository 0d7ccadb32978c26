"""The search: budget, seed, one call for each generation."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.tuning.evolution import Stop, members, minimise

AIM = np.array([0.3, 0.8])


def bowl(designs: np.ndarray) -> np.ndarray:
    return ((designs - AIM) ** 2).sum(axis=1)


def test_finds_the_least() -> None:
    found = minimise(bowl, np.array([0.9, 0.1]), 600, seed=1)
    np.testing.assert_allclose(found.design, AIM, atol=0.01)
    assert found.cost == pytest.approx(bowl(found.design[None, :])[0])
    assert list(found.history) == sorted(found.history, reverse=True)


@pytest.mark.parametrize("evaluations", [1, 2, 4, 5, 9, 21, 100, 300, 301])
def test_keeps_its_budget(evaluations: int) -> None:
    """A generation is one call, all of one size, and the calls add up to what is reported."""
    calls: list[int] = []

    def counted(designs: np.ndarray) -> np.ndarray:
        calls.append(len(designs))
        assert designs.shape[1] == 2
        assert np.all((designs >= 0.0) & (designs <= 1.0))
        return bowl(designs)

    found = minimise(counted, np.array([0.5, 0.5]), evaluations, seed=0)
    assert sum(calls) == found.evaluations <= evaluations
    assert len(set(calls)) == 1
    assert len(found.history) == len(calls)
    assert found.evaluations > evaluations - calls[0]


def test_a_search_that_is_stopped_gives_the_best_so_far() -> None:
    def stop(done: int, best: float) -> None:
        if done >= 40:
            raise Stop

    found = minimise(bowl, np.array([0.9, 0.1]), 600, seed=1, progress=stop)
    assert found.evaluations == 40 and len(found.history) == 2
    assert found.cost == found.history[-1] == pytest.approx(bowl(found.design[None, :])[0])


def test_a_generation_has_ten_designs_a_knob() -> None:
    assert members(300, 2) == 20
    assert members(60, 2) == 15
    assert members(10_000, 3) == 30


def test_the_start_is_tried() -> None:
    """So the result is never worse, even of a single evaluation."""
    for evaluations in (1, 6, 30):
        assert minimise(bowl, AIM, evaluations, seed=3).cost == 0.0


def test_a_seed_repeats_the_search() -> None:
    runs = [minimise(bowl, np.array([0.5, 0.5]), 100, seed=s) for s in (1, 1, 2)]
    assert np.array_equal(runs[0].design, runs[1].design)
    assert not np.array_equal(runs[0].design, runs[2].design)


def test_flat_costs_do_not_end_it() -> None:
    found = minimise(lambda d: np.full(len(d), 7.0), np.array([0.5]), 100, seed=0)
    assert found.evaluations > 80


def test_progress_and_stopping() -> None:
    heard: list[tuple[int, float]] = []
    found = minimise(bowl, AIM, 100, 0, progress=lambda done, best: heard.append((done, best)))
    assert [h[0] for h in heard][-1] == found.evaluations

    def stop(done: int, best: float) -> None:
        if done > 40:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        minimise(bowl, AIM, 100, 0, progress=stop)
