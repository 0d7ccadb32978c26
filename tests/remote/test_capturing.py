"""Captures by the Python clients, as numpy arrays and as files."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from web_parts import Station

from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.remote.asynchronous import AsyncMachine
from macromicro.remote.capturing import Curves
from macromicro.remote.failures import RequestRefused
from macromicro.remote.machine import Machine
from macromicro.serve.capturing import Trigger
from macromicro.serve.shared import INDEX, NAMES, WRITTEN, Shared
from macromicro.serve.web import WebServer

Make = Callable[..., Machine]


@pytest.fixture
def written(fake: Station) -> Iterator[Shared]:
    """A ring that is written all the time: the motor is on in every other 100 rows."""
    ring = Shared.create(5000)
    fake.loop.shared, enough = ring, threading.Event()

    def write() -> None:
        while not enough.wait(1e-3):
            for _ in range(5):
                n = int(ring.cells[WRITTEN])
                row = [0.0] * len(NAMES)
                row[INDEX["t"]], row[INDEX["position"]] = n * 1e-3, float(n)
                row[INDEX["motor"]] = float(n % 200 >= 100)
                ring.put(row)
            fake.captures.look()

    thread = threading.Thread(target=write)
    thread.start()
    yield ring
    enough.set()
    thread.join()


def test_curves_are_arrays_with_units(client: Make, written: Shared) -> None:
    stage = client(control=False)
    edge = Trigger("edge", "motor", "rising", 0.5)
    capture = stage.capture(["position", "motor"], edge, before=0.02, after=0.03)
    curves = capture.wait(30.0)
    assert curves.names == ("position", "motor") and curves.units == ("mm", "V")
    assert curves.time == pytest.approx(np.arange(-20, 31) * 1e-3)
    assert curves["motor"].tolist() == [0.0] * 20 + [1.0] * 31
    assert np.diff(curves["position"]) == pytest.approx(1.0)
    assert curves.triggered % 0.2 == pytest.approx(0.1)
    assert capture.state == "complete"
    with pytest.raises(InputError, match="position, motor"):
        curves["speed"]
    capture.end()
    with pytest.raises(RequestRefused, match="nothing is being captured"):
        capture.wait(30.0)


def test_a_repeated_capture_gives_one_after_the_other(client: Make, written: Shared) -> None:
    stage = client(control=False)
    level = Trigger("level", "motor", "falling", 0.5)
    capture = stage.capture("motor", level, after=0.01, repeat=True)
    first, second = capture.wait(30.0), capture.wait(30.0)
    assert second.triggered > first.triggered and second["motor"][0] == 0.0


def test_what_is_accepted_is_told(client: Make, written: Shared) -> None:
    stage = client(control=False)
    for signals, trigger, said in (
        ("velocity", "now", "position"),
        ("motor", "noon", "now, edge, level"),
        ("motor", Trigger("edge", "motor", "flat"), "rising, falling, either"),
    ):
        with pytest.raises(RequestRefused, match=said):
            stage.capture(signals, trigger)
    with pytest.raises(RequestRefused, match="at most 56 s together"):
        stage.capture("motor", before=30.0, after=30.0)
    waiting = stage.capture("motor", "fault")
    time.sleep(0.1)
    assert waiting.state == "waiting"
    with pytest.raises(TimeoutError):
        waiting.wait(0.1)


def test_the_asynchronous_client_captures_alike(server: WebServer, written: Shared) -> None:
    async def captured() -> Curves:
        host, port = server.address
        async with AsyncMachine(host, port, token="sesame", control=False) as stage:
            capture = await stage.capture("position", after=0.01)
            assert await capture.state() in ("waiting", "triggered", "complete")
            curves = await capture.wait()
            await capture.end()
            return curves

    assert asyncio.run(captured())["position"].shape == (11,)


def test_curves_are_saved_as_a_table_and_as_a_recording(tmp_path: Path) -> None:
    curves = Curves(("x", "u"), ("mm", "V"), np.array([-0.5, 0.0]), np.eye(2), 7.25)
    curves.save(tmp_path / "curves.csv")
    lines = (tmp_path / "curves.csv").read_text().splitlines()
    assert lines == ["t [s],x [mm],u [V]", "-0.5,1,0", "0,0,1"]
    for _ in range(2):  # an existing file is replaced
        curves.save(tmp_path / "curves.h5")
    found = Recording.load(tmp_path / "curves.h5")
    assert found["t"].tolist() == [-0.5, 0.0] and found.unit("u") == "V"
    assert found.dt == 0.5 and found.attributes["triggered_s"] == 7.25
    with pytest.raises(InputError, match="ends in"):
        curves.save(tmp_path / "curves.txt")
