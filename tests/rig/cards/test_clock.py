"""Deadlines stay on their grid, whatever is late."""

from __future__ import annotations

import pytest

from macromicro.rig.cards import _rig as _clock


class Time:
    """A clock that the test moves; sleeping takes as long as was asked, and a little."""

    def __init__(self) -> None:
        self.t = 100.0

    def monotonic(self) -> float:
        return self.t

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.t += seconds + 1e-5


def test_the_grid_stays_and_missed_periods_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    time = Time()
    monkeypatch.setattr(_clock, "time", time)
    made = _clock.Deadlines()
    time.t += 5.0
    made.start()
    assert made.now() == 0.0
    for k in range(1, 4):
        time.t += 3e-4  # work
        made.wait(1e-3)
        assert made.now() == pytest.approx(k * 1e-3 + 1e-5), "no drift"
    time.t += 2.5e-3  # held up: two periods and a half
    made.wait(1e-3)
    assert made.now() == pytest.approx(5.51e-3), "begins at once"
    made.wait(1e-3)
    assert made.now() == pytest.approx(6e-3 + 1e-5), "back on the grid"
