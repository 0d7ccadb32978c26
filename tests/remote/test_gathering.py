"""Moves of two axes from threads, before a machine in the test's hand."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import pytest

from macromicro.remote import gathering
from macromicro.remote.failures import MotionFailed, RequestRefused


class Fake:
    """Begins what it is asked for, at once; `state.motion` is the test's."""

    def __init__(self) -> None:
        self.state = SimpleNamespace(motion=0)
        self.asked: list[tuple[Any, ...]] = []
        self.refusal: Exception | None = None

    def _begin(self, *words: Any) -> Any:
        self.asked.append(words)
        if self.refusal is not None:
            raise self.refusal
        return words

    def move_point(self, x: float, y: float, *, wait: bool) -> Any:
        assert not wait
        return self._begin("point", x, y)

    def move_axis(self, axis: str, position: float, *, wait: bool) -> Any:
        assert not wait
        return self._begin("axis", axis, position)


def fine() -> None:
    """The move is wanted."""


def stopped() -> None:
    raise MotionFailed("x", "stopped", "", {})


def both(
    fake: Fake, first: Callable[[], None] = fine, second: Callable[[], None] = fine
) -> list[Any]:
    """Moves of both at once: what became of each."""
    gathered = gathering.of(fake)  # type: ignore[arg-type]

    def go(axis: str, goal: float, check: Callable[[], None]) -> Any:
        try:
            return gathered.begin(axis, goal, check)
        except Exception as error:
            return type(error)

    with ThreadPoolExecutor(2) as pool:
        done = [pool.submit(go, "y", 0.03, first), pool.submit(go, "x", 0.02, second)]
        return [future.result(20.0) for future in done]


def test_what_is_asked_for_together_is_one_motion_of_both() -> None:
    fake = Fake()
    assert both(fake) == [("point", 0.02, 0.03)] * 2
    assert len(fake.asked) == 1
    assert gathering.of(fake).begin("x", 0.01, fine) == ("axis", "x", 0.01)  # type: ignore[arg-type]


def test_it_begins_once_nothing_else_moves() -> None:
    """And what is asked for until then joins it."""
    fake = Fake()
    fake.state.motion = 7
    gathered = gathering.of(fake)  # type: ignore[arg-type]
    with ThreadPoolExecutor(2) as pool:
        one = pool.submit(gathered.begin, "x", 0.02, fine)
        with pytest.raises(TimeoutError):
            one.result(4.0 * gathering.GATHER_S)
        other = pool.submit(gathered.begin, "y", 0.03, fine)
        with pytest.raises(TimeoutError):
            other.result(2.0 * gathering.GATHER_S)
        assert fake.asked == []
        fake.state.motion = 0
        assert one.result(20.0) == other.result(20.0) == ("point", 0.02, 0.03)


def test_one_that_is_stopped_does_not_wait_for_what_moves() -> None:
    fake, gone = Fake(), threading.Event()
    fake.state.motion = 7
    gathered = gathering.of(fake)  # type: ignore[arg-type]

    def check() -> None:
        if gone.is_set():
            stopped()

    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(gathered.begin, "x", 0.02, fine)
        second = pool.submit(gathered.begin, "y", 0.03, check)
        with pytest.raises(TimeoutError):
            second.result(2.0 * gathering.GATHER_S)
        gone.set()
        try:
            with pytest.raises(MotionFailed):
                second.result(20.0)
            assert not first.done()
        finally:
            fake.state.motion = 0
        assert first.result(20.0) == ("axis", "x", 0.02)


def test_one_that_is_stopped_before_it_begins_leaves_the_other() -> None:
    fake = Fake()
    assert both(fake, fine, stopped) == [("axis", "y", 0.03), MotionFailed]
    assert both(fake, stopped, stopped) == [MotionFailed] * 2
    assert len(fake.asked) == 1


def test_a_refusal_is_that_of_both() -> None:
    fake = Fake()
    fake.refusal = RequestRefused("disabled", "enable it first")
    assert both(fake) == [RequestRefused] * 2


def test_a_stop_that_holds_the_lock_lets_nothing_begin() -> None:
    fake, gone = Fake(), threading.Event()
    gathered = gathering.of(fake)  # type: ignore[arg-type]

    def check() -> None:
        if gone.is_set():
            stopped()

    with ThreadPoolExecutor(1) as pool:
        with gathered.lock:
            move = pool.submit(gathered.begin, "x", 0.02, check)
            gone.set()
        with pytest.raises(MotionFailed):
            move.result(20.0)
    assert fake.asked == []
