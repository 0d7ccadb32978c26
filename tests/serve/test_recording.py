"""The recorder's thread: everything that the ring held is in the file, whatever the disk does."""

from __future__ import annotations

import errno
import math
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro import recorder
from macromicro import recording as recordings
from macromicro.control.live import messages as m
from macromicro.errors import InputError, MacromicroError
from macromicro.serve._ledger import Trail
from macromicro.serve._recording import ASKED, Means, Recording
from macromicro.serve.shared import COLUMNS, INDEX, Shared
from macromicro.serve.snapshot import Trouble
from macromicro.serve.station import Station
from tests.waiting import until


def fill(shared: Shared, first: int, count: int) -> None:
    for k in range(first, first + count):
        row = [0.25] * len(COLUMNS)
        row[0] = k * 1e-3
        row[INDEX["mode"]] = row[INDEX["fan"]] = 1.0
        row[INDEX["motion"]] = row[INDEX["trusted"]] = row[INDEX["fault"]] = 0.0
        row[INDEX["extend"]] = row[INDEX["contract"]] = row[INDEX["laser_reset"]] = math.nan
        row[INDEX["uncertainty"]] = math.inf
        shared.put(row)


def record(shared: Shared, path: Path, failed: Any = print, capacity: int = 500) -> Recording:
    return Recording(shared, Trail(), path, capacity, {"rig": "twin"}, failed)


def test_every_row_from_the_start_on_is_in_the_file(tmp_path: Path) -> None:
    shared = Shared.create(4000)
    fill(shared, 0, 100)
    recording = record(shared, tmp_path / "a.h5")
    fill(shared, 100, 700)
    until(lambda: recording.state.rows == 700)
    fill(shared, 800, 900)
    state = recording.end()
    assert state == (False, str(tmp_path / "a.h5"), 1600, 0, "")
    read = recordings.Recording.load(tmp_path / "a.h5")
    assert np.array_equal(np.round(read["t"] * 1e3), np.arange(100, 1700))
    assert set(read["extend"]) == {-1}
    assert np.isinf(read["uncertainty"]).all()
    assert read.attributes["rig"] == "twin"


def test_a_file_says_whether_its_end_was_asked_for_and_the_last_fault(tmp_path: Path) -> None:
    shared = Shared.create(1000)
    fill(shared, 0, 10)
    asked = Means(fault=lambda: None)
    Recording(shared, Trail(), tmp_path / "a.h5", 10, {}, print, means=asked).end()
    said = recordings.Recording.load(tmp_path / "a.h5").attributes
    assert said["finished"] == 1 and "fault" not in said and said["ended"] == ASKED
    met = Trouble(7, "stall", "It does not move.", "0.1 V, 0 counts", "Free it.")
    there = Means(fault=lambda: met)
    Recording(shared, Trail(), tmp_path / "b.h5", 10, {}, print, means=there).end("the loop ended")
    said = recordings.Recording.load(tmp_path / "b.h5").attributes
    assert said["finished"] == 0 and said["fault"] == "It does not move. 0.1 V, 0 counts"


def test_rows_that_came_too_fast_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = Shared.create(1000)
    go = threading.Event()
    drain = Recording._drain

    def held(self: Recording) -> None:
        go.wait()
        drain(self)

    monkeypatch.setattr(Recording, "_drain", held)
    recording = record(shared, tmp_path / "a.h5")
    fill(shared, 0, 2500)
    go.set()
    state = recording.end()
    assert state.lost > 1000
    assert state.rows + state.lost == 2500
    read = recordings.Recording.load(tmp_path / "a.h5")
    assert read["t"][-1] == pytest.approx(2.499)


def test_a_full_disk_ends_the_recording_and_loses_nothing_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = Shared.create(4000)
    reasons: list[str] = []
    recording = record(shared, tmp_path / "a.h5", reasons.append, 10_000)
    fill(shared, 0, 300)
    until(lambda: recording.state.rows == 300)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(recorder, "write_all", full)
    fill(shared, 300, 300)
    until(lambda: reasons)
    monkeypatch.undo()
    assert "No space left on device" in reasons[0]
    state = recording.end()
    assert (state.active, state.rows) == (False, 300)
    assert state.error == reasons[0]
    read = recordings.Recording.load(tmp_path / "a.h5")
    assert np.array_equal(np.round(read["t"] * 1e3), np.arange(300))


@pytest.mark.parametrize(("action", "end"), [("go on", "done"), ("stop", "stopped")])
def test_the_machine_goes_on_or_stops_as_configured(
    action: str,
    end: str,
    station: Callable[..., Station],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    machine = station(recorder_failure=action)
    machine.start()
    machine.record(tmp_path / "a.h5")
    with pytest.raises(MacromicroError, match="under way"):
        machine.record(tmp_path / "b.h5")
    machine.acquire("test")
    moving = machine.request("test", m.MoveTo(1.5 if action == "go on" else 600.0))
    assert isinstance(moving, m.Accepted)
    until(lambda: machine.snapshot().recording.rows > 100)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(recorder, "write_all", full)
    finished = machine.finished(moving.id, 60.0)
    until(lambda: ("recording", "failed") in [(e.kind, e.cause) for e in machine.events()[1]])
    monkeypatch.undo()
    assert finished is not None
    assert finished.outcome == end
    state = machine.snapshot().recording
    assert not state.active
    assert "No space left" in state.error
    read = recordings.Recording.load(tmp_path / "a.h5")
    assert read.rows == state.rows > 100
    assert np.allclose(np.diff(read["t"]), 1e-3)


def test_an_existing_file_is_refused_and_the_machine_runs_on(
    station: Callable[..., Station], tmp_path: Path
) -> None:
    machine = station()
    with pytest.raises(MacromicroError, match="start it first"):
        machine.record(tmp_path / "a.h5")
    machine.start()
    (tmp_path / "a.h5").write_text("mine")
    with pytest.raises(InputError, match="already exists"):
        machine.record(tmp_path / "a.h5")
    assert machine.snapshot().running
    machine.record(tmp_path / "a.h5", overwrite=True)
    until(lambda: machine.snapshot().recording.rows)
    state = machine.end_recording()
    assert recordings.Recording.load(tmp_path / "a.h5").rows == state.rows > 0


def test_what_happened_is_in_the_file_with_who_caused_it(tmp_path: Path) -> None:
    """Readable while it is written, behind more of it than was reserved, and at the end."""
    shared, trail = Shared.create(4000), Trail()
    recording = Recording(shared, trail, tmp_path / "a.h5", 10, {"rig": "twin"}, print)
    fill(shared, 0, 20)
    trail.order(0.01, "scpi 127.0.0.1:7", m.MoveTo(0.042), m.Accepted(3))
    until(lambda: recordings.Recording.load(tmp_path / "a.h5").events)
    for k in range(100):
        trail.event(m.Event(k * 1e-3, "mode", "ready", "homing", f"home {k}", {"n": math.nan}))
    trail.client("token", "web ::1", "this is not the token")
    recording.end()
    found = recordings.Recording.load(tmp_path / "a.h5")
    assert len(found) == 20 and len(found.events) == 102
    first, *_, last = found.events
    assert first[:4] == (0.01, "order", "scpi 127.0.0.1:7", "MoveTo")
    assert first.facts == {"position": 0.042, "replace": False, "motion": 3}
    assert math.isnan(last.t) and last[1:4] == ("token", "web ::1", "this is not the token")
    shared.close()
