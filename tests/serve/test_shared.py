"""The shared memory: rows come out as they went in, and lost ones are counted."""

from __future__ import annotations

import os
import threading
from typing import Any

import numpy as np
import pytest

from macromicro.control import outside
from macromicro.place import LENGTH
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import (
    COLUMNS,
    LAMPS,
    STATUS_TURN,
    WRITTEN,
    Shared,
    StageStatus,
    Status,
    telemetry_of,
)
from tests.control.own_laws import HERE


def fill(shared: Shared, first: int, count: int) -> None:
    for k in range(first, first + count):
        shared.put([k + 0.001 * c for c in range(len(COLUMNS))])


def test_rows_come_out_in_order_and_only_once() -> None:
    shared = Shared.create(100)
    assert shared.last() is None
    fill(shared, 0, 30)
    lost, count, block = shared.since(0)
    assert (lost, count, block.shape) == (0, 30, (len(COLUMNS), 30))
    assert block[0].tolist() == list(range(30))
    assert block[5, 7] == 7.005
    assert shared.since(count)[2].shape == (len(COLUMNS), 0)
    fill(shared, 30, 50)  # 80 of 100: no wrap yet
    fill(shared, 80, 50)  # across the end of the ring
    lost, count, block = shared.since(65)
    assert (lost, count) == (0, 130)
    assert block[0].tolist() == list(range(65, 130))
    newest = shared.last()
    assert newest is not None
    assert newest[0] == 129.0


def test_a_slow_reader_is_told_how_many_rows_it_lost() -> None:
    shared = Shared.create(100)
    fill(shared, 0, 250)
    lost, count, block = shared.since(10)
    assert count == 250
    assert lost == block[0, 0] - 10
    assert block[0].tolist() == list(range(10 + lost, 250))
    assert 100 - 30 < block.shape[1] < 100


def test_a_count_from_an_earlier_memory_gives_nothing() -> None:
    shared = Shared.create(100)
    fill(shared, 0, 5)
    lost, count, block = shared.since(4000)
    assert (lost, count, block.shape[1]) == (0, 5, 0)


def test_two_mappings_are_the_same_memory() -> None:
    form = telemetry_of((LENGTH,) * 3, ("x", "y", "z"))
    one = Shared.create(50, form)
    other = Shared(os.dup(one.fd), 50, form)
    fill(one, 0, 3)
    lamps = tuple(map(float, range(len(LAMPS))))
    offsets = ((-12.0, 0.5), (3.0, 0.25), (np.nan, np.nan))
    stages = tuple(StageStatus(*each, lamps) for each in offsets)
    told = Status(3.0, fault=7.0, offset=-12.0, target=0.5)
    one.set_status([*told[:-1], *(value for stage in stages for value in (*stage[:2], *lamps))])
    one.close()
    lost, count, block = other.since(0)
    assert (lost, count, len(block)) == (0, 3, len(form.columns))
    assert np.isnan(block[len(COLUMNS) :]).all()  # of which the rows had nothing
    found = other.status()
    assert found._replace(stages=()) == told
    assert found.stages[:2] == stages[:2] and np.isnan(found.stages[2][:2]).all()


def test_a_status_half_written_by_a_killed_loop_is_shown_all_the_same() -> None:
    shared = Shared.create(50)
    shared.set_status(Status(periods=3.0)[:-1])
    shared.cells[STATUS_TURN] += 1
    assert shared.status().periods == 3.0


def test_a_row_shows_only_once_it_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = Shared.create(50)
    seen, row = [], shared._row

    class Watched:
        size = row.size

        def pack_into(self, *what: Any) -> None:
            row.pack_into(*what)
            seen.append(int(shared.cells[WRITTEN]))

    monkeypatch.setattr(shared, "_row", Watched())
    fill(shared, 0, 2)
    assert seen == [0, 1]


def test_row_and_status_are_of_one_instant() -> None:
    shared = Shared.create(16)
    assert shared.now() is None
    enough = threading.Event()

    def write() -> None:
        k = 0.0
        while not enough.is_set():
            k += 1.0
            shared.show([k] * len(COLUMNS), Status(periods=k)[:-1])

    writer = threading.Thread(target=write)
    writer.start()
    try:
        seen = set()
        while len(seen) < 50:
            now = shared.now()
            if now is not None:
                number, row, status = now
                assert number == row[0] == status.periods
                seen.add(number)
    finally:
        enough.set()
        writer.join()


def test_a_set_point_has_room_for_every_stage() -> None:
    """It lies between the status and the ring, and touches neither."""
    names = tuple("abcdefghijkl")
    memory = Shared.create(100, telemetry_of((LENGTH,) * len(names), names))
    point = tuple((float(k), -1.0 - k) for k in range(len(names)))
    before = memory.status()
    memory.set_point(point, 17)
    assert memory.point(2) == (point, 17) and memory.point(1) is None
    assert memory.status() == before and not memory.ring.any()


def test_another_process_knows_the_columns_of_a_users_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that is handed the settings has not yet looked for their law."""
    settings = LiveSettings()
    settings = settings._replace(controller=settings.controller.joined(f"{HERE}:sliding", "law"))
    names = settings.telemetry.names
    assert names[-1] == "law_speed"
    monkeypatch.setattr(outside, "_laws", {})
    monkeypatch.setattr(outside, "_by_gains", {})
    assert settings.telemetry.names == names
