"""A cable that is pulled, in a network of its own: run by test_faults_cable under `unshare -n`.

Prints JSON: how the jog of the client behind the cable ended, who holds control then, and
after how many seconds.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from pathlib import Path

from macromicro.serve.scpi import Server
from macromicro.serve.settings import LiveSettings
from macromicro.serve.station import Station


def loopback(state: str) -> None:
    subprocess.run(["ip", "link", "set", "lo", state], check=True)


def main(folder: Path) -> None:
    loopback("up")
    settings = LiveSettings()
    # The client's own watchdog and the server's time for silence are out of the way.
    serve = settings.serve._replace(miss_share=1.0, parent_timeout=5.0, client_timeout=3600.0)
    settings = settings._replace(serve=serve)
    with (
        Station(settings=settings, state=folder / "state.json") as station,
        Server(station, port=0, folder=folder) as server,
        socket.create_connection(server.address, timeout=60.0) as client,
    ):
        client.sendall(b"SYST:LOCK:REQ?;:ENAB;HOME;*OPC?;:JOG:MACR 1 MM/S\n")
        answer = b""
        while b"\n" not in answer:
            answer += client.recv(100)
        while station.snapshot().mode != "moving-macro":
            time.sleep(0.01)
        motion = station.snapshot().motion
        loopback("down")
        pulled = time.monotonic()
        end = station.finished(motion, 60.0)
        seconds = time.monotonic() - pulled
        told = {
            "answer": answer.decode().strip(),
            "outcome": None if end is None else end.outcome,
            "holder": station.snapshot().holder,
            "seconds": seconds,
        }
        loopback("up")
    print(json.dumps(told))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
