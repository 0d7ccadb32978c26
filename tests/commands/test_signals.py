"""What a signal leaves behind on a terminal."""

from __future__ import annotations

import os
import pty
import subprocess
import sys

HIDDEN, SHOWN = b"\x1b[?25l", b"\x1b[?25h"
INTERRUPTED = """
import os, signal
from macromicro.commands.signals import Signals
from macromicro.drawing.bar import progress_bar

with Signals(), progress_bar() as bar:
    bar.add_task("searching")
    os.kill(os.getpid(), signal.SIGINT)
"""


def test_an_interrupted_command_leaves_a_cursor() -> None:
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm"}
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], stderr=theirs, env=environment, check=False
    )
    os.close(theirs)
    said = os.read(ours, 100_000)
    os.close(ours)
    assert done.returncode == 130
    assert HIDDEN in said and said.rindex(SHOWN) > said.rindex(HIDDEN)
    assert b"macromicro: interrupted\r\n" in said
