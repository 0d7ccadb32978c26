"""A cable that is pulled, in a network of its own: run by test_faults_cable under `unshare -n`.

Prints JSON: how the motion of the client behind the cable ended, who holds control then, and
after how many seconds control was free.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from macromicro.serve.gcs import GcsServer
from macromicro.serve.scpi import Server
from macromicro.serve.settings import LiveSettings
from macromicro.serve.station import Station
from macromicro.serve.web import WebServer


def loopback(state: str) -> None:
    subprocess.run(["ip", "link", "set", "lo", state], check=True)


def line(client: socket.socket) -> str:
    answer = b""
    while b"\n" not in answer:
        answer += client.recv(100)
    return answer.decode().strip()


@contextlib.contextmanager
def scpi(station: Station, folder: Path) -> Iterator[None]:
    """A client that jogs."""
    with (
        Server(station, port=0, folder=folder) as server,
        socket.create_connection(server.address, timeout=60.0) as client,
    ):
        client.sendall(b"SYST:LOCK:REQ?;:ENAB;HOME;*OPC?;:JOG:MACR 1 MM/S\n")
        assert line(client) == "1;1"
        yield


@contextlib.contextmanager
def gcs(station: Station, folder: Path) -> Iterator[None]:
    """A client that homes, and moves after that."""
    with (
        GcsServer(station) as server,
        socket.create_connection(server.address, timeout=60.0) as client,
    ):
        client.sendall(b"SVO 1 1\nFRF\nERR?\n")
        assert line(client) == "0"
        yield


@contextlib.contextmanager
def page(station: Station, folder: Path) -> Iterator[None]:
    """A client of the page's port that homes and is told nothing more."""
    from websockets.sync.client import connect

    with WebServer(station, port=0, folder=folder) as server:
        origin: Any = f"http://127.0.0.1:{server.address[1]}"
        where = f"ws://127.0.0.1:{server.address[1]}/live"
        with connect(where, origin=origin, proxy=None, ping_interval=None) as client:
            client.send(json.dumps({"do": "hello", "program": True, "frames": False}))
            for number, what in enumerate(("take", "enable", "home")):
                client.send(json.dumps({"do": what, "id": number}))
                while json.loads(client.recv()).get("reply") != number:
                    pass
            yield


@contextlib.contextmanager
def channel_access(station: Station, folder: Path) -> Iterator[None]:
    """A client of EPICS that jogs."""
    where = {"ADDR_LIST": "127.0.0.1", "AUTO_ADDR_LIST": "NO", "MAX_ARRAY_BYTES": "100000"}
    os.environ.update({f"EPICS_CA_{name}": value for name, value in where.items()})
    import epics

    from macromicro.serve.epics.server import EpicsServer

    with EpicsServer(station, "T"):
        for name in ("enable", "home"):
            assert epics.caput(f"T:{name}", 1, wait=True, timeout=60.0) == 1
        epics.caput("T:whole.JVEL", 1.0, wait=True)
        epics.caput("T:whole.JOGF", 1)
        yield


PROTOCOLS = {"scpi": scpi, "gcs": gcs, "page": page, "epics": channel_access}


def main(folder: Path, protocol: str) -> None:
    loopback("up")
    settings = LiveSettings()
    # The client's own watchdog and the server's time for silence are out of the way.
    serve = settings.serve._replace(miss_share=1.0, parent_timeout=5.0, client_timeout=3600.0)
    settings = settings._replace(serve=serve)
    with (
        Station(settings=settings, state=folder / "state.json") as station,
        PROTOCOLS[protocol](station, folder),
    ):
        while not (motion := station.snapshot().motion):
            time.sleep(0.01)
        loopback("down")
        pulled = time.monotonic()
        while station.snapshot().holder and time.monotonic() < pulled + 60.0:
            time.sleep(0.02)
        seconds = time.monotonic() - pulled
        end = station.finished(motion, 5.0)
        told = {
            "outcome": None if end is None else end.outcome,
            "holder": station.snapshot().holder,
            "seconds": seconds,
        }
        loopback("up")
    print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
