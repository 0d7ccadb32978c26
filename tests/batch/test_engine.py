"""Pieces over threads: order, bounded look-ahead, errors, and an end at any time."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from macromicro import batch
from macromicro.arrays import Array
from macromicro.batch import Metric, Variants
from macromicro.errors import InputError
from macromicro.machines.machine import JOINT, MACHINES


class Slow:
    """A job whose result is its values; later pieces are done sooner. Counts what is at work."""

    name = "slow"
    metrics = (Metric("same", "", "the value"),)

    def __init__(self, block: int = 2, bad: int | None = None) -> None:
        self.block, self.bad = block, bad
        self.begun = 0
        self._lock = threading.Lock()

    def base(self) -> Any:
        return ()

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        if not len(variants.values):
            return np.empty((0, 1))
        with self._lock:
            self.begun += 1
            odd = self.begun % 2
        time.sleep(2e-3 * odd)
        if self.bad is not None and first <= self.bad < first + len(variants.values):
            raise InputError(f"variant {self.bad}", "bad", "good")
        return np.array(variants.values)


def sets(number: int, size: int, taken: list[int] | None = None) -> Iterator[Variants]:
    for k in range(number):
        if taken is not None:
            taken.append(k)
        yield Variants(("x",), np.arange(k * size, (k + 1) * size, dtype=float)[:, None])


@pytest.mark.parametrize("threads", [1, 2, 5, None])
def test_results_come_in_order(threads: int | None) -> None:
    got = list(batch.run(Slow(), sets(9, 5), threads))
    assert np.array_equal(np.concatenate([m for _, m in got])[:, 0], np.arange(45.0))
    assert [first for first, _ in got] == np.cumsum([0, *(len(m) for _, m in got[:-1])]).tolist()


@pytest.mark.parametrize("threads", [1, 3])
def test_look_ahead_is_bounded(threads: int) -> None:
    """However long the stream, no more sets are taken than the threads need."""
    taken: list[int] = []
    most = 0
    for done, _ in enumerate(batch.run(Slow(), sets(200, 2, taken), threads)):
        most = max(most, len(taken) - done)
    assert len(taken) == 200
    assert most <= 2 * threads + 2


def test_a_stream_need_not_be_finished() -> None:
    taken: list[int] = []
    running = batch.run(Slow(), sets(10**9, 2, taken), 2)
    first, _ = next(running)
    running.close()  # type: ignore[attr-defined]
    assert first == 0
    assert len(taken) < 10


@pytest.mark.parametrize("threads", [1, 2])
def test_results_before_an_error_are_given(threads: int) -> None:
    given: list[float] = []
    with pytest.raises(InputError, match="variant 13"):
        for _, values in batch.run(Slow(bad=13), sets(20, 2), threads):
            given.extend(values[:, 0])
    assert given == list(range(len(given)))
    assert len(given) in (12, 13)  # 12 stands in the piece of 13, or before it


@pytest.mark.parametrize("threads", [0, -1, True, 1.5])
def test_threads_are_a_whole_number(threads: Any) -> None:
    with pytest.raises(InputError, match="threads"):
        batch.run(Slow(), sets(1, 1), threads)


def test_nothing_to_do() -> None:
    assert list(batch.run(Slow(), [], 2)) == []
    assert list(batch.run(Slow(), Variants(("x",), np.empty((0, 1))), 2)) == []


def test_names() -> None:
    benches = {"macro-bench", "micro-bench", "programme"}
    assert set(batch.JOBS) == benches | {machine.name for machine in MACHINES} | {JOINT}
    for name in batch.JOBS:
        job = batch.job(name)
        assert job.name == name
        assert job.block >= 1
        names = [m.name for m in job.metrics]
        assert len(set(names)) == len(names)
    with pytest.raises(InputError, match="macro-bench or"):
        batch.job("macro")


def test_cores() -> None:
    assert batch.cores() >= 1
