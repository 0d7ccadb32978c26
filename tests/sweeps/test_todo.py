"""Chunks cover what is not finished, once, in whole blocks where that can be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.sweeps._journal import merged
from macromicro.sweeps._todo import Todo
from macromicro.sweeps.work import sized, smoothed

SPANS = st.lists(st.tuples(st.integers(0, 90), st.integers(1, 20)), max_size=6)


@given(st.integers(1, 100), SPANS, st.integers(1, 30), st.integers(1, 8), st.data())
def test_chunks_cover_what_is_left_once(
    count: int, pairs: list[tuple[int, int]], size: int, block: int, data: st.DataObject
) -> None:
    """Some are given back and come again."""
    spans = [(a, min(a + n, count)) for a, n in pairs if a < count]
    done = merged(np.array(spans, dtype=np.int64).reshape(-1, 2))
    finished = {i for low, high in done for i in range(low, high)}
    todo, seen, lefts = Todo(count, done), [], []
    assert todo.left == count - len(finished)
    while todo:
        chunk = todo.take(size, block)
        lefts.append(todo.left)
        if data.draw(st.integers(0, 9)) == 0 and chunk.deaths == 0:
            todo.give_back(chunk._replace(deaths=1))
            continue
        assert 1 <= chunk.size <= max(size, block)
        end = chunk.first + chunk.size
        if size % block == 0:  # else there are no whole blocks to give
            assert end % block == 0 or end == count or end in done[:, 0]
        seen += range(chunk.first, end)
    assert sorted(seen) == [i for i in range(count) if i not in finished]
    assert todo.left == 0


@pytest.mark.parametrize(
    "each, block, share, size",
    [
        (None, 64, 1000, 64),  # before anything is measured
        (0.01, 1, 1000, 50),
        (1e-5, 64, 10**6, 50_048),  # 50 000 in whole blocks
        (1e-5, 64, 500, 512),  # near the end
        (100.0, 8, 1000, 8),  # never less than a block
    ],
)
def test_half_a_second_of_work(each: float | None, block: int, share: int, size: int) -> None:
    assert sized(each, 0.5, block, share) == size


def test_a_first_call_that_compiles_is_soon_forgotten() -> None:
    """Down at once, up slowly."""
    assert smoothed(None, 10.0) == 10.0
    assert smoothed(10.0, 0.01) == 0.01
    assert smoothed(0.01, 0.02) == pytest.approx(0.013)
