"""A stop of a client whose motion may have ended."""

from __future__ import annotations

import asyncio

from macromicro.control.live import messages as m
from macromicro.serve.scpi._message import parse
from macromicro.serve.scpi.server import attempt
from macromicro.serve.scpi.tree import TREE


def test_an_emergency_stop_looks_for_nothing_first(bench, monkeypatch) -> None:
    def broken(motion: int, timeout: float) -> None:
        raise AssertionError("it was looked for")

    monkeypatch.setattr(bench.station, "finished", broken)
    session = bench.session
    session.began(1, "move")
    for text in (b"ABOR", b"STOP"):
        asyncio.run(attempt(session, parse(TREE, text).units[0], session.stops, session.failed))
    assert bench.station.emergencies == 1
    assert m.Stop("test") in bench.station.requests
    assert len(session.errors) == 0
