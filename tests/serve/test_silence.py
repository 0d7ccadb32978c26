"""A laser that falls silent stops nothing, and is told once."""

from __future__ import annotations

import math

from macromicro.serve.ticking import PERIODS, Silence


def told(silence: Silence, *values: float) -> list[tuple[int, str]]:
    events = [silence.look(value, float(k)) for k, value in enumerate(values)]
    return [(k, e.cause) for k, e in enumerate(events) if e is not None]


def test_it_is_told_when_it_goes_and_when_it_is_back() -> None:
    gone = [math.nan] * (3 * PERIODS)
    found = told(Silence(True), 0.0, *gone, 0.0, 0.0)
    assert found == [(PERIODS, "laser lost"), (len(gone) + 1, "laser back")]


def test_a_missing_value_now_and_then_is_nothing() -> None:
    assert told(Silence(True), *([math.nan] * (PERIODS - 1) + [0.0]) * 5) == []


def test_a_rig_without_a_laser_has_none_to_lose() -> None:
    assert told(Silence(False), *[math.nan] * 50, 0.0) == []
