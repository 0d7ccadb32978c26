"""What the soak does to the machine, and which faults may come of it."""

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
from typing import NamedTuple

import faulty
from macromicro.rig import codes
from macromicro.serve import faults
from soak.victim import Client, Victim

_HALL = (codes.HALL_RANGE, codes.HALL_NOISY, codes.MICRO_LOST)
_DRIVE = (codes.STUCK, codes.MACRO_LOST)
_WIRE = (codes.NO_MOTION, codes.TOO_HOT, codes.MICRO_LOST)


class Trial(NamedTuple):
    """A fault of the bench, or of what is around it. `stage`: the motion that it is to meet
    ("macro", "micro"); `codes` that it may raise; `sure`: must one of them come?"""

    name: str
    stage: str
    codes: tuple[int, ...]
    sure: bool = True


BENCH = (
    # The laser tells of these, too; whichever finds them first.
    Trial("encoder-frozen", "macro", (*_DRIVE, faults.LOST_COUNTS)),
    Trial(
        "encoder-reversed",
        "macro",
        (codes.MACRO_LOST, codes.ENCODER_AGAINST, codes.STUCK, faults.LOST_COUNTS),
    ),
    # What is left of a move may be too short for two counts to be lost.
    Trial("encoder-skipping", "macro", (*_DRIVE, faults.LOST_COUNTS), False),
    Trial("encoder-jump", "macro", (codes.ENCODER_JUMP,)),
    Trial("encoder-silent", "macro", (codes.ENCODER_SILENT,)),
    Trial("hall-stuck", "micro", (codes.HALL_FROZEN, *_WIRE)),
    Trial("hall-range", "micro", _HALL),
    Trial("hall-low", "micro", _HALL),
    Trial("hall-noisy", "micro", (codes.HALL_NOISY,)),
    Trial("hall-silent", "micro", (codes.HALL_SILENT,)),
    Trial("laser-lost", "micro", (), False),
    Trial("wire-broken", "micro", _WIRE),
    Trial("motor-dead", "macro", _DRIVE),
    Trial("fan-lost", "micro", (), False),
    Trial("carriage-stuck", "macro", _DRIVE),
    Trial("clock-ahead", "macro", (codes.CLOCK,)),
    Trial("clock-back", "micro", (codes.CLOCK,)),
    # With its end the clock jumps as well.
    Trial("clock-stands", "macro", (codes.CLOCK_STANDS, codes.CLOCK)),
    Trial("clock-none", "micro", (codes.CLOCK_STANDS, codes.CLOCK)),
    Trial("slow", "macro", (faults.LATE,)),
)
AROUND = (
    Trial("client killed", "macro", (), False),
    Trial("client half-open", "macro", (), False),
    Trial("client floods", "macro", (), False),
    Trial("client sends garbage", "macro", (), False),
    Trial("disk full", "macro", (), False),
    Trial("two busy processes", "macro", (faults.LATE,), False),
)
assert all(t.name in faulty.FAULTS for t in BENCH)


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
