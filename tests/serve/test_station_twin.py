"""The real machine on the twin, through the station: homed, moved, killed, started again."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.recording import Recording
from macromicro.serve import _background, persist
from macromicro.serve.persist import Kept
from macromicro.serve.station import Station
from tests.serve.quick import quick
from tests.systems import posix
from tests.waiting import until


def loop_of(station: Station) -> int:
    started = [e for e in station.events()[1] if e.kind == "loop" and e.cause == "started"]
    return int(started[-1].evidence["process"])


def ask(station: Station, request: m.Request) -> int:
    reply = station.request("test", request)
    assert isinstance(reply, Accepted), reply
    return reply.id


@posix
def test_trust_from_homing_to_a_kill(tmp_path: Path) -> None:
    station = Station(settings=quick(loop_timeout=5.0), state=tmp_path / "position.json")
    with station:
        station.acquire("test")
        ask(station, m.Enable())
        refused = station.request("test", m.MoveTo(0.02))
        assert isinstance(refused, Refused)
        assert "home" in refused.remedy
        station.record(tmp_path / "run.h5")
        homed = station.finished(ask(station, m.Home()), 120.0)
        assert homed is not None
        assert homed.outcome == "done"
        moved = station.finished(ask(station, m.MoveMacro(120)), 120.0)
        assert moved is not None
        assert moved.outcome == "done"
        until(lambda: abs(station.snapshot().macro_count - 120.0) <= 2.0)
        state = station.end_recording()
        assert (state.error, state.lost) == ("", 0)
    run = Recording.load(tmp_path / "run.h5")
    assert set(np.unique(run["trusted"])) == {0, 1}
    assert abs(run["motor"]).max() > 3.0
    left = station.snapshot()

    with station:  # an orderly end: the place is known
        now = station.snapshot()
        assert now.trusted
        assert now.macro_count == pytest.approx(left.macro_count, abs=1.0)
        assert now.uncertainty_m < 1e-4
        station.acquire("test")
        ask(station, m.Enable())
        motion = ask(station, m.MoveMacro(1500))
        os.kill(loop_of(station), signal.SIGKILL)
        lost = station.finished(motion, 30.0)
        assert lost is not None
        assert lost.outcome == "lost"
        kept = persist.load(tmp_path / "position.json")
        assert isinstance(kept, persist.Kept)
        assert kept.moving

    with station:  # a kill on the way: it is not
        assert not station.snapshot().trusted
        until(lambda: "interrupted" in station.snapshot().trust)
        station.acquire("test")
        ask(station, m.Enable())
        assert isinstance(station.request("test", m.MoveTo(0.02)), Refused)


AT_SPEED = 300.0  # counts


@pytest.fixture
def coasting(tmp_path: Path) -> Iterator[Station]:
    """A trusted machine that was disabled on its way: the carriage coasts."""
    settings = quick(loop_timeout=5.0)
    path = tmp_path / "position.json"
    persist.save(path, Kept(settings.kept_as("twin"), 0.0, 0.0, True, "homed", False, 0.0))
    with Station(settings=settings, state=path) as station:
        station.acquire("test")
        ask(station, m.Enable())
        ask(station, m.MoveMacro(2500))
        until(lambda: station.snapshot().macro_count > AT_SPEED)
        ask(station, m.Disable())
        until(lambda: station.snapshot().mode == "disabled")
        _background.call(station._connection.keep())  # which goes on by itself, too, now and then
        yield station


def kept(folder: Path) -> Kept:
    found = persist.load(folder / "position.json")
    assert isinstance(found, Kept)
    return found


def test_the_file_says_moving_until_the_carriage_has_come_to_rest(
    coasting: Station, tmp_path: Path
) -> None:
    until(lambda: not kept(tmp_path).moving)
    left = kept(tmp_path)
    assert left.encoder - left.offset > AT_SPEED + 2.0  # from there on it was disabled
    time.sleep(0.5)
    assert abs(coasting.snapshot().macro_count - (left.encoder - left.offset)) <= 1.0
    assert left.trusted  # it was counted all the way
    assert coasting.snapshot().trusted


@posix
def test_a_kill_while_it_coasts_is_noticed(coasting: Station, tmp_path: Path) -> None:
    os.kill(loop_of(coasting), signal.SIGKILL)
    until(lambda: not coasting.snapshot().running)
    assert kept(tmp_path).moving


def test_an_orderly_end_waits_until_it_stands(coasting: Station, tmp_path: Path) -> None:
    coasting.stop()
    left = kept(tmp_path)
    assert (left.moving, left.trusted) == (False, True)
    assert left.encoder == pytest.approx(coasting.snapshot().macro_count + left.offset, abs=1.0)
