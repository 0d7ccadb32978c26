"""Runs of many machines, in threads: compiled runs release the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

Found = TypeVar("Found")


def trials(
    run: Callable[[Any, int], Found],
    trees: Sequence[Any],
    seeds: Sequence[int],
    workers: int,
    done: Callable[[int], bool] = lambda count: False,
) -> list[Found]:
    """What runs of settings with seeds give, in order; `done` may end them early."""
    found: list[Found] = []
    with ThreadPoolExecutor(workers) as pool:
        waiting = [pool.submit(run, *each) for each in zip(trees, seeds, strict=True)]
        for one in waiting:
            found.append(one.result())
            if done(len(found)):
                pool.shutdown(wait=False, cancel_futures=True)
                break
    return found
