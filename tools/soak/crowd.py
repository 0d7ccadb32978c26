"""Stops in a hostile crowd: how long they take from a client's send to safe outputs.

    PYTHONPATH=tools python -m soak.crowd

Clients without control send what costs a server most, as fast as it is taken, while others
stop the machine over SCPI and from the page. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import random
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import faulty
from soak.disturbing import reset
from soak.victim import Client, Victim, until

LINE = 64_000  # bytes, just below the longest line
KINDS: dict[str, bytes] = {
    "bad commands": b"\xff;" * (LINE // 2) + b"\n",
    "unknown commands": b"NON:SENSE;" * (LINE // 10) + b"\n",
    "empty commands": b"; " * (LINE // 2) + b"\n",
    "quotes": b"*ESE " + b"'" * LINE + b"\n",
    "empty lines": b"\n" * LINE,
    "waveforms": b"FORM ASC;:WAV:DATA? position,60 S\n",
    "queries": b"POS?;:SYST:HELP:HEAD?;:GAIN:CAT?;:EVEN?\n" * 200,
    "orders": b"MOVE:MACR 2900;:SYST:LOCK:REQ?\nPROG:LOAD 'thesis'\n" * 100,
}
SCPI, PAGE = "SCPI", "page"


def stops(victim: Victim, rounds: int, hostile: int) -> dict[str, list[float]]:
    """Times [s] from a client's send of an emergency stop to outputs safe, over SCPI and from
    the page, each so many times, beside `hostile` clients at once. NaN: none within 2 s.
    `victim` runs, with a page."""
    own, watcher, rng = Client(victim.port), Client(victim.port), random.Random(1)
    until(lambda: own.ask("SYST:LOCK:REQ?") == "1")
    found: dict[str, list[float]] = {SCPI: [], PAGE: []}
    with _crowd(victim, hostile), _page(victim) as emergency:
        ways: list[tuple[str, Callable[[], None]]] = [
            (SCPI, lambda: watcher.send("ABOR")),
            (PAGE, emergency),
        ]
        for _ in range(rounds):
            for name, way in rng.sample(ways, 2):
                found[name].append(_stop(victim, own, way, rng))
    for client in (own, watcher):
        client.close()
    return found


def _stop(victim: Victim, own: Client, way: Callable[[], None], rng: random.Random) -> float:
    cells = victim.cells
    speed = rng.choice((-1, 1))  # slowly, as its place is not trusted; and not to an end
    until(lambda: _moves(victim, own, f"JOG:MACR {speed} MM/S"))
    time.sleep(rng.uniform(0.0, 0.03))
    sent, deadline = time.monotonic_ns(), time.monotonic() + 2.0
    way()
    while not cells[faulty.SAFE_AT] >= 0.0:
        if time.monotonic() > deadline:
            own.send("ABOR")
            return float("nan")
        time.sleep(0.002)
    return max(float(cells[faulty.SAFE_NS] - sent) * 1e-9, 0.0)


def _moves(victim: Victim, own: Client, order: str) -> bool:
    """Order it again, where it is not under way."""
    own.send("FAUL:CLE")
    own.ask(f"ENAB;:{order};*CLS;:MODE?")
    with contextlib.suppress(Exception):
        until(lambda: not victim.cells[faulty.SAFE_AT] >= 0.0, 0.3)
        return True
    return False


@contextlib.contextmanager
def _page(victim: Victim) -> Iterator[Callable[[], None]]:
    """A page that watches; what presses its emergency stop."""
    from websockets import Origin
    from websockets.sync.client import connect

    origin = Origin(f"http://127.0.0.1:{victim.page}")
    url = f"ws://127.0.0.1:{victim.page}/live"
    with connect(url, origin=origin, proxy=None, max_size=None) as live:
        live.send(json.dumps({"do": "hello"}))
        live.recv(10.0)
        reader = threading.Thread(target=_read, args=(live,), daemon=True)
        reader.start()
        yield lambda: live.send(json.dumps({"do": "emergency", "id": 1}))


def _read(live: object) -> None:
    with contextlib.suppress(Exception):
        for _ in live:  # type: ignore[attr-defined]
            pass


@contextlib.contextmanager
def _crowd(victim: Victim, hostile: int) -> Iterator[None]:
    """So many hostile clients, in a process of their own."""
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    process = context.Process(target=_pester, args=(victim.port, hostile, ready), daemon=True)
    if hostile:
        process.start()
        ready.wait(60.0)
        time.sleep(0.5)
    try:
        yield
    finally:
        if hostile:
            process.kill()
            process.join()


def _pester(port: int, hostile: int, ready: threading.Event) -> None:
    kinds = list(KINDS.values())
    for k in range(hostile):
        each = threading.Thread(target=_send, args=(port, kinds[k % len(kinds)]), daemon=True)
        each.start()
    ready.set()
    threading.Event().wait()


def _send(port: int, data: bytes) -> None:
    """Send it again and again; come back where the connection is ended."""
    while True:
        with contextlib.suppress(OSError):
            pest = Client(port)
            pest.ask("*IDN?")
            reader = threading.Thread(target=_swallow, args=(pest,), daemon=True)
            reader.start()
            with contextlib.suppress(OSError):
                while True:
                    pest.socket.sendall(data)
            reset(pest)
        time.sleep(0.01)


def _swallow(pest: Client) -> None:
    with contextlib.suppress(OSError, ValueError):
        while pest.socket.recv(1 << 16):
            pass


def main() -> int:
    """The command; exit status 1 where a stop was not heard."""
    parser = argparse.ArgumentParser(prog="python -m soak.crowd")
    parser.add_argument("--rounds", type=int, default=200, help="stops each way")
    parser.add_argument("--hostile", type=int, default=8, help="clients at once")
    given = parser.parse_args()
    deaf = 0
    print("| hostile clients | stop | median [ms] | 99 % [ms] | longest [ms] | stops |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="macromicro-crowd-") as folder:
        victim = Victim(Path(folder), 1, page=True)
        victim.start()
        try:
            for hostile in (0, given.hostile):
                for name, times in stops(victim, given.rounds, hostile).items():
                    ms = 1e3 * np.asarray(times)
                    deaf += int(np.isnan(ms).sum())
                    half, most, worst = np.percentile(ms, (50.0, 99.0, 100.0))
                    row = f"| {hostile} | {name} | {half:.1f} | {most:.1f} | {worst:.1f} "
                    print(f"{row}| {ms.size} |", flush=True)
        finally:
            victim.end()
    return 1 if deaf else 0


if __name__ == "__main__":
    sys.exit(main())
