"""A signal that comes while a rig is open takes its course once the outputs are safe."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator

import pytest

from macromicro.rig._unwinding import Unwinding
from macromicro.rig.session import Session


@pytest.fixture
def told() -> Iterator[list[int]]:
    """Signals that reach the process's own handlers."""
    numbers: list[int] = []
    before = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, lambda n, frame: numbers.append(n))
    yield numbers
    for number, handler in before.items():
        signal.signal(number, handler)


class Rig:
    """A rig whose stop is disturbed by one more signal."""

    def __init__(self, told: list[int]) -> None:
        self.told, self.done = told, []

    def stop(self) -> None:
        signal.raise_signal(signal.SIGTERM)
        self.done.append("stop")

    def __enter__(self) -> Rig:
        return self

    def __exit__(self, *what: object) -> None:
        assert not self.told  # not before the rig is left
        self.done.append("exit")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_unwinds_first_and_then_takes_its_course(told: list[int], number: int) -> None:
    rig = Rig(told)
    with pytest.raises(KeyboardInterrupt), Session(rig, 1e-3):
        signal.raise_signal(number)
        raise AssertionError("nothing may be driven after the signal")
    assert rig.done == ["stop", "exit"]
    assert told == [number]
    signal.raise_signal(signal.SIGINT)  # the old handlers are back
    assert told == [number, signal.SIGINT]


def test_what_was_ignored_stays_ignored(told: list[int]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    held = Unwinding()
    held.begin()
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM)
    held.end()
    assert told == [signal.SIGTERM]


def test_another_thread_changes_nothing(told: list[int]) -> None:
    before = signal.getsignal(signal.SIGTERM)
    held = Unwinding()
    thread = threading.Thread(target=held.begin)
    thread.start()
    thread.join()
    assert signal.getsignal(signal.SIGTERM) is before
    held.end()
    assert not told
