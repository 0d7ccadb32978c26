"""Stops a rig from a fresh process after its loop process did not; SIGALRM bounds it in time."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

from macromicro.rig.opening import TWIN
from macromicro.schema.text import printable
from macromicro.serve._launching import fresh_python

LIMIT_S = 10.0  # for Python, the rig's module, opening it and its stop
TERM_S = 0.25  # in which a process that was sent SIGTERM has to end
KILL_S = 2.0  # in which a killed one has to be gone: a driver may hold it in the kernel
_LATE = "it did not return in {:g} s"
_CODE = "from macromicro.serve._safing import main; main()"


class Safed(NamedTuple):
    """What was done about the outputs."""

    done: bool  # the rig's `stop` returned
    words: str


def end(process: subprocess.Popen[bytes]) -> str:
    """End a process by SIGTERM, then SIGKILL; what was done."""
    for finish, name, wait in (
        (process.terminate, "SIGTERM", TERM_S),
        (process.kill, "SIGKILL", KILL_S),
    ):
        with contextlib.suppress(ProcessLookupError, PermissionError):  # it has ended
            finish()
        try:
            process.wait(wait)
            return f"the loop process was ended by {name}"
        except subprocess.TimeoutExpired:
            pass
    return "the loop process does not end, not even by SIGKILL: the rig's driver holds it"


def stop(rigs: Sequence[str], seed: int) -> Safed:
    """Call `stop` of the named rigs from fresh processes, in parallel, within `LIMIT_S` and 1 s."""
    with ThreadPoolExecutor(len(rigs)) as pool:
        found = list(pool.map(_stop, rigs, range(seed, seed + len(rigs))))
    if len(rigs) == 1:
        return found[0]
    words = "; ".join(f"{rig}: {one.words}" for rig, one in zip(rigs, found, strict=True))
    return Safed(all(one.done for one in found), words)


def _stop(rig: str, seed: int) -> Safed:
    """Stop one rig; the twin has ended with its loop process."""
    if rig == TWIN:
        return Safed(True, "the virtual bench ended with its loop process")
    began = time.monotonic()
    try:
        done = subprocess.run(
            **fresh_python(_CODE, rig, str(seed)),
            capture_output=True,
            text=True,
            start_new_session=True,
            timeout=LIMIT_S + 1.0,
            check=False,
        )
    except OSError as error:
        return _failure(printable(error, 120))
    except subprocess.TimeoutExpired:
        return _failure(_LATE.format(LIMIT_S))
    took = time.monotonic() - began
    if done.returncode == 0:
        return Safed(
            True,
            f"a fresh process opened the rig and its stop returned, {took:.1f} s later; nothing "
            "read the outputs back",
        )
    if done.returncode == -getattr(signal, "SIGALRM", 0):
        return _failure(_LATE.format(LIMIT_S))
    lines = done.stderr.strip().splitlines()
    return _failure(printable(lines[-1] if lines else f"status {done.returncode}", 200))


def _failure(why: str) -> Safed:
    kept = "the outputs may still be as last written"
    words = f"a fresh process could not stop the rig ({why}); {kept}"
    return Safed(False, words)


def main() -> None:
    """Open the rig, stop it, leave it; exit status 0 if its stop returned."""
    if hasattr(signal, "SIGALRM"):  # elsewhere the caller waits a second longer
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    from macromicro.rig.opening import named
    from macromicro.rig.session import Session

    rig, seed = sys.argv[1], int(sys.argv[2])
    with Session(named(rig)(seed), 1e-3) as session:
        session.stop()
