"""Wall times of functions that take turns, so that a busy machine is busy for all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence


def alternating(runs: Sequence[Callable[[], object]], repeats: int) -> list[list[float]]:
    """Times [s] of each, `repeats` of them; a first round is not counted."""
    times: list[list[float]] = [[] for _ in runs]
    for k in range(repeats + 1):
        for run, kept in zip(runs, times, strict=True):
            start = time.perf_counter()
            run()
            if k:
                kept.append(time.perf_counter() - start)
    return times
