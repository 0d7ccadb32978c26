"""What a signal leaves behind on a terminal."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from macromicro.models.mass import Axis, simulate
from tests.systems import posix

pytestmark = posix

HIDDEN, SHOWN = b"\x1b[?25l", b"\x1b[?25h"
INTERRUPTED = """
import os, signal
from macromicro.commands.signals import Signals
from macromicro.drawing.console import progress_bar

with Signals(), progress_bar() as bar:
    bar.add_task("searching")
    os.kill(os.getpid(), signal.SIGINT)
"""


def read_all(terminal: int) -> bytes:
    """All that was written to a terminal whose other end is closed; one read may be a part."""
    said = b""
    with contextlib.suppress(OSError):  # the end
        while part := os.read(terminal, 100_000):
            said += part
    os.close(terminal)
    return said


def test_an_interrupted_command_leaves_a_cursor() -> None:
    ours, theirs = os.openpty()
    environment = {**os.environ, "TERM": "xterm"}
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], stderr=theirs, env=environment, check=False
    )
    os.close(theirs)
    said = read_all(ours)
    assert done.returncode == 130
    assert HIDDEN in said and said.rindex(SHOWN) > said.rindex(HIDDEN)
    assert b"macromicro: interrupted\r\n" in said


SEARCHED = """
import os, signal, sys
import scipy.optimize
from macromicro.cli import main

solve, calls = scipy.optimize.least_squares, []

def interrupted(missed, *given, **options):
    def counted(at):
        calls.append(1)
        if len(calls) == 5:
            os.kill(os.getpid(), signal.SIGINT)
        return missed(at)
    return solve(counted, *given, **options)

scipy.optimize.least_squares = interrupted
sys.argv = "macromicro identify drive record.csv --structure coulomb --out found".split()
status = main()
print(len(calls), file=sys.stderr)
sys.exit(status)
"""


@pytest.mark.slow
def test_an_interrupted_search_keeps_its_best(tmp_path: Path) -> None:
    """Two kilograms, 1 N of friction, and Ctrl-C at the fifth simulation of the first search."""
    n, dt = 4000, 1e-3
    u = 5.0 * np.sign(np.sin(2.0 * np.pi * np.arange(n) * dt))
    x = simulate(Axis(mass=2.0, viscous=3.0, coulomb=1.0), u, dt)
    rows = np.column_stack(
        [np.arange(n) * dt, u, x + 1e-6 * np.random.default_rng(1).normal(size=n)]
    )
    np.savetxt(tmp_path / "record.csv", rows, delimiter=",", header="t_s,u_N,x_m", comments="")
    done = subprocess.run(
        [sys.executable, "-c", SEARCHED], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 130, done.stderr
    assert "ending with the best fit so far" in done.stderr
    found = json.loads((tmp_path / "found" / "result.json").read_text())
    assert any("the search had not ended" in text for text in found["warnings"])
    mass = next(line for line in found["values"] if line["name"] == "mass")
    assert mass["value"] == pytest.approx(2.0, rel=0.1)
    assert "the search had not ended" in done.stderr
