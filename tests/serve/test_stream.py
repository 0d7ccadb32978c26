"""Streamed set points on their way to the loop: time stamps, and the memory that both share."""

from __future__ import annotations

import math
from typing import Any

import pytest
from loop_parts import Scene

from macromicro.control.live import messages as m
from macromicro.control.live.accept import NOT_FOLLOWING
from macromicro.place import LENGTH
from macromicro.serve import station
from macromicro.serve.shared import POINT, RENEWED, Shared, telemetry_of
from macromicro.serve.station import Stream


class Shown:
    """Notes what the loop would be shown, as if motion 3 were under way."""

    def __init__(self) -> None:
        self.points: list[tuple[Any, int]] = []

    def under_way(self, motion: int) -> bool:
        return motion == 3

    def point(self, point: Any, at: int) -> None:
        self.points.append((point, at))


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    clock = [100.0]
    monkeypatch.setattr(station.time, "monotonic", lambda: clock[0])
    return clock


def test_delays_on_the_way_that_vary_are_made_up_for(now: list[float]) -> None:
    shown, stream = Shown(), Stream(3)
    for k, delay in enumerate((0.004, 0.001, 0.05, 0.002)):
        now[0] = 100.0 + 0.1 * k + delay
        assert stream.take(shown, m.SetPoint(0.1, 0.2), 5.0 + 0.1 * k) is None
    ages = [at * 1e-9 - (100.0 + 0.1 * k) for k, (_, at) in enumerate(shown.points)]
    assert ages == pytest.approx([0.004, 0.001, 0.001, 0.001], abs=1e-4)
    assert stream.take(shown, m.SetPoint(0.3), 5.1) is None  # overtaken: left out
    assert len(shown.points) == 4 and shown.points[0][0] == ((0.1, 0.2),)


def test_a_point_without_a_time_is_as_it_comes(now: list[float]) -> None:
    shown, stream = Shown(), Stream(3, 2)
    assert stream.take(shown, m.SetPoints(((0.1, 0.3), (0.2, 0.4)))) is None
    assert shown.points == [(((0.1, 0.3), (0.2, 0.4)), 100 * 10**9)]


@pytest.mark.parametrize(
    ("stream", "point", "said"),
    [
        (Stream(3), m.SetPoint(math.nan), "give finite numbers"),
        (Stream(3), m.SetPoint(0.1, math.inf), "give finite numbers"),
        (
            Stream(3),
            m.SetPoints(((0.1, 0.0), (0.1, 0.0))),
            "give the positions of those that follow",
        ),
        (Stream(4), m.SetPoint(0.1), NOT_FOLLOWING.remedy),
    ],
)
def test_what_nothing_follows_is_refused(stream: Stream, point: Any, said: str) -> None:
    shown = Shown()
    refused = stream.take(shown, point)
    assert refused is not None and refused.remedy == said
    assert shown.points == []


def test_a_point_that_is_being_written_is_not_read() -> None:
    shared = Shared.create(10, telemetry_of((LENGTH, LENGTH), ("x", "y")))
    shared.set_point(((0.1, 0.2), (0.3, 0.4)), 77)
    assert shared.point(2) == (((0.1, 0.2), (0.3, 0.4)), 77)
    shared.cells[POINT] += 1
    assert shared.point(2) is None and shared.point(3) is None
    shared.close()


def test_the_loop_hands_on_the_newest_point_once() -> None:
    scene = Scene()
    heard: list[Any] = []
    scene.machine.heard = lambda point, age: heard.append((point, age)) or ()  # type: ignore
    scene.machine.renew = lambda: heard.append("renewed")  # type: ignore[attr-defined]

    def two() -> None:
        scene.shared.set_point(((1.0, 0.0),), 0)
        scene.shared.set_point(((2.0, 0.5),), 0)

    def half() -> None:
        scene.shared.cells[POINT] += 1

    scene.bench.at[51], scene.bench.at[53] = two, half
    scene.bench.at[55] = half
    scene.bench.at[57] = lambda: scene.shared.cells.__setitem__(RENEWED, 1)
    scene.run()
    assert [each if each == "renewed" else each[0] for each in heard] == [
        ((2.0, 0.5),), ((2.0, 0.5),), "renewed",
    ]  # fmt: skip
    assert all(each == "renewed" or each[1] > 0.0 for each in heard)


def test_a_clock_that_makes_no_sense_does_no_harm(now: list[float]) -> None:
    shown, stream = Shown(), Stream(3)
    for stamp in (math.inf, -math.inf, 1e300):
        refused = stream.take(shown, m.SetPoint(0.1), stamp)
        assert refused is not None and refused.beyond
    assert stream.take(shown, m.SetPoint(0.1), -1e12) is None
    assert stream.take(shown, m.SetPoint(0.1), 1e12) is None
    assert [at for _, at in shown.points] == [100 * 10**9] * 2
