"""What the soak does around a machine: clients, disk, processor, port."""

from __future__ import annotations

import contextlib
import multiprocessing
import random
import resource
import socket
import struct
import subprocess
import time
from collections.abc import Iterator

from soak.victim import Client, Victim

KILLED, HALF_OPEN = "client killed", "client half-open"
FLOODS, GARBAGE = "client floods", "client sends garbage"
FULL_DISK, BUSY = "disk full", "two busy processes"
NAMES = (KILLED, HALF_OPEN, FLOODS, GARBAGE, FULL_DISK, BUSY)


def reset(client: Client) -> None:
    """Let the client go as a killed one: with a reset."""
    client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    client.close()


def pester(victim: Victim, rng: random.Random, seconds: float, garbage: bool) -> int:
    """Send as fast as it goes and read nothing; how many bytes were taken."""
    orders = b"POS?;:MODE?;:MOVE:MACR 2900;:SYST:LOCK:REQ?\n" * 100
    pest, sent, deadline = Client(victim.port), 0, time.monotonic() + seconds
    pest.ask("*IDN?")  # what does not begin as SCPI is let go at once
    pest.socket.settimeout(0.1)
    with contextlib.suppress(ConnectionError):
        while time.monotonic() < deadline:
            with contextlib.suppress(TimeoutError):
                sent += pest.socket.send(rng.randbytes(4000) if garbage else orders)
    reset(pest)
    return sent


@contextlib.contextmanager
def full_disk(victim: Victim) -> Iterator[None]:
    """No file of the server may grow or be written beyond 64 kB (as on a full disk)."""
    before = resource.prlimit(victim.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(victim.pid, resource.RLIMIT_FSIZE, (65536, before[1]))
    try:
        yield
    finally:
        resource.prlimit(victim.pid, resource.RLIMIT_FSIZE, before)


@contextlib.contextmanager
def busy(processes: int = 2) -> Iterator[None]:
    """Two processes that compute and never rest."""
    context = multiprocessing.get_context("spawn")
    all_of_them = [context.Process(target=_spin, daemon=True) for _ in range(processes)]
    for each in all_of_them:
        each.start()
    try:
        yield
    finally:
        for each in all_of_them:
            each.kill()
            each.join()


def _spin() -> None:
    while True:
        pass


def port_in_use(victim: Victim) -> str:
    """What a second server says where the port is taken; it has its own position file."""
    command = victim.command(victim.port)
    place = command.index("--state") + 1
    command[place] = f"{victim.state}.second"
    done = subprocess.run(command, capture_output=True, text=True, timeout=180.0, check=False)
    return done.stderr.strip().splitlines()[-1] if done.returncode else "it started"
