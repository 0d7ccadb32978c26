"""Two threads of one connection: its worker looks for ends of motions, a stop overtakes it."""

from __future__ import annotations

import threading

from macromicro.control.live import messages as m
from macromicro.serve.scpi._execution import attempt
from macromicro.serve.scpi._message import parse
from macromicro.serve.scpi.tree import TREE


def test_an_end_is_told_once_whoever_looks(bench, monkeypatch) -> None:
    """Both threads see the end of the same motion at the same time."""
    session, station = bench.session, bench.station
    both = threading.Barrier(2)
    problems: list[BaseException] = []

    def finished(motion: int, timeout: float) -> m.Finished:
        both.wait(10.0)
        return m.Finished(motion, "stalled", 0.0, 0.0, {})

    monkeypatch.setattr(station, "finished", finished)

    def look() -> None:
        try:
            session.poll()
        except BaseException as error:
            problems.append(error)

    for number in range(1, 21):
        session.began(number, "move")
        other = threading.Thread(target=look)
        other.start()
        look()
        other.join()
    assert problems == []
    assert len(session.errors) == 20


def test_an_emergency_stop_looks_for_nothing_first(bench, monkeypatch) -> None:
    def broken(motion: int, timeout: float) -> None:
        raise AssertionError("it was looked for")

    monkeypatch.setattr(bench.station, "finished", broken)
    session = bench.session
    session.began(1, "move")
    for text in (b"ABOR", b"STOP"):
        attempt(session, parse(TREE, text).units[0], session.stops, session.failed)
    assert bench.station.emergencies == 1
    assert m.Stop("test") in bench.station.requests
    assert len(session.errors) == 0
