"""Set points streamed by a Python client: before a fake station, and to a real server."""

from __future__ import annotations

import asyncio
import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from tests.serve.stage.test_served import example, served
from tests.systems import posix
from tests.waiting import until
from web_parts import Station

from macromicro.control.live import messages as m
from macromicro.errors import InputError
from macromicro.remote.asynchronous import AsyncMachine
from macromicro.remote.failures import MotionFailed, RequestRefused
from macromicro.remote.machine import Machine, connect
from macromicro.serve.web import WebServer

STREAMER = """
import math, sys, time
import macromicro
with macromicro.connect(sys.argv[1], int(sys.argv[2])) as stage:
    with stage.follow(hold=1.0) as stream:
        began = time.monotonic()
        while True:
            t = time.monotonic() - began
            stream.put(0.03 + 0.01 * math.sin(2.0 * t), 0.02 * math.cos(2.0 * t))
            if t > 1.0:
                print("streams", flush=True)
            time.sleep(0.002)
"""


def test_points_go_out_with_their_units_and_times(
    client: Callable[..., Machine], fake: Station
) -> None:
    stage = client()
    with pytest.raises(MotionFailed, match="as lost"), stage.follow("micro", hold=0.5) as stream:
        assert fake.requests[-1] == m.Follow("micro", 0.5, fake.requests[-1].client)
        stream.put("1.5 mm", "20 um/s")
        until(lambda: len(fake.points) == 1)
        stream.put(1e-3)
        until(lambda: len(fake.points) == 2)
        with pytest.raises(InputError):
            stream.put("far")
        with pytest.raises(InputError):
            stream.put(math.nan)
        fake.end("lost")
        until(stream._inner._tasks[0].done)
        stream.put(2e-3)
    assert [p for p, _ in fake.points] == [m.SetPoint(pytest.approx(1.5e-3), pytest.approx(2e-5)),
                                           m.SetPoint(1e-3, 0.0)]  # fmt: skip
    assert fake.points[1][1] > fake.points[0][1]


def test_it_ends_as_done_or_by_a_stop(client: Callable[..., Machine], fake: Station) -> None:
    stage = client()
    with pytest.raises(MotionFailed, match="as stopped"), stage.follow() as stream:
        stream.put(0.01)
        until(lambda: fake.points)
        until(lambda: not fake.end("stopped"))  # by somebody else
    with pytest.raises(ZeroDivisionError), stage.follow():
        raise ZeroDivisionError
    until(lambda: isinstance(fake.requests[-1], m.Stop))
    with pytest.raises(RequestRefused), stage.follow():
        fake.requests.clear()
        fake.mode = "disabled"
        stage.move_to(0.01)


def test_a_jog_is_kept_going_by_the_client_or_by_its_caller(
    client: Callable[..., Machine], fake: Station
) -> None:
    stage = client()
    stage.jog("macro", 0.01)
    until(lambda: fake.renewed)
    assert fake.requests[-1].hold == 0.4
    fake.end("stopped")
    stage.jog("macro", 0.01, hold=0.2)
    assert fake.requests[-1].hold == 0.2
    time.sleep(0.15)  # a message on its way
    fake.renewed.clear()
    time.sleep(0.3)
    assert fake.renewed == []


def test_the_asynchronous_client_streams_alike(server: WebServer, fake: Station) -> None:
    async def stream() -> None:
        host, port = server.address
        async with AsyncMachine(host, port, token="sesame") as stage:
            async with stage.follow("macro") as stream:
                stream.put(0.01, 0.02)
                while not fake.points:
                    await asyncio.sleep(0.01)
                asyncio.get_running_loop().call_later(0.2, fake.end, "done")
            assert isinstance(fake.requests[-1], m.EndFollow)

    asyncio.run(stream())
    assert fake.points[0][0] == m.SetPoint(0.01, 0.02)


@posix
@pytest.mark.parametrize(
    ("how", "why"),
    [("SIGSTOP", "hold time over"), pytest.param("SIGKILL", "", marks=pytest.mark.slow)],
)
def test_a_streamed_sine_is_followed_and_a_client_that_hangs_or_dies_ends_it(
    tmp_path: Path, how: str, why: str
) -> None:
    with served(tmp_path, example("screw")) as terminal:
        address = urlsplit(terminal.page)
        where = str(address.hostname), int(address.port or 0)
        with connect(*where) as stage:
            stage.ready()
            stage.move_to(0.03)
            with stage.follow(hold=1.0) as stream:
                for k in range(500):
                    stream.put(0.03 + 0.005 * math.sin(0.006 * k), 0.015 * math.cos(0.006 * k))
                    time.sleep(0.001)
                stream.put("31.5 mm")
            end = stream.motion.wait()
            assert end["position"] == pytest.approx(0.0315, abs=2e-5)
            assert end["evidence"]["set_points"] > 50
            stage.release()
            watcher = connect(*where, control=False)
            line = [sys.executable, "-c", STREAMER, *map(str, where)]
            with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as streamer:
                assert streamer.stdout is not None and streamer.stdout.readline()
                number = watcher.state.motion
                assert number
                streamer.send_signal(signal.Signals[how])
                until(lambda: watcher.state.motion == 0)
                streamer.kill()
            end = terminal.ask(f"MOVE:OUTC? {number}")
            assert end.startswith('"lost"') and why in end
            resting = watcher.position
            time.sleep(0.3)
            assert watcher.position == pytest.approx(resting, abs=5e-6)
            watcher.close()
