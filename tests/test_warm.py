"""Processes forked from a warm Python begin as a Python of their own would."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from macromicro.sweeps.processes import processes, submit
from tests.warm import Command

pytestmark = pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="POSIX only")


def test_signals_blocked_for_one_process_are_not_for_the_next() -> None:
    """A sweep's workers ignore Ctrl-C; a command that is started after them does not."""
    with processes(1) as pool:
        blocked = submit(pool, signal.pthread_sigmask, signal.SIG_BLOCK, ()).result()
    assert signal.SIGINT in blocked
    text = "import signal; print(signal.pthread_sigmask(signal.SIG_BLOCK, ()))"
    done = Command([sys.executable, "-c", text], stdout=subprocess.PIPE)
    assert done.communicate()[0] == b"set()\n"
