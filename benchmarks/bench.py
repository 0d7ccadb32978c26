"""How fast it is: prints a table and writes results/bench.json. `make bench` runs it.

Medians of several runs, on one core. Targets are for a common desktop machine; nothing
is asserted.
"""

from __future__ import annotations

import json
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import parts
import tools

import macromicro
from macromicro import programme as programmes
from macromicro.columns import COLUMNS
from macromicro.loop import PERIOD
from macromicro.recording import Recorder
from macromicro.settings import Settings
from macromicro.simulate import simulate

RESULTS = Path(__file__).resolve().parents[1] / "results" / "bench.json"
LIMITS = programmes.Limits(0.0, 2800.0, 0.0, 3.9e-3, 14000.0)
REAL_TIME = 1e9 * PERIOD  # ns


class Line(NamedTuple):
    """A figure: what, target as text ("" without one), measured (None: not), unit, remark."""

    figure: str
    target: str
    measured: float | None
    unit: str
    remark: str = ""


def timed(run: Callable[[], object], repeats: int) -> float:
    """Median wall time [s] of `run` after one run that is not counted."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return median(times)


def integrated(cycles: int, repeats: int) -> tuple[float, float]:
    """Wall time [s] and simulated time [s] of the integrated test, recorded to a file."""
    what = programmes.load(programmes.find("thesis"), LIMITS).repeated(cycles)
    simulated = 0.0
    with tempfile.TemporaryDirectory() as folder:

        def run() -> None:
            nonlocal simulated
            place = Path(folder) / "recording.h5"
            rows = round(95.0 * cycles / PERIOD)
            with Recorder(place, COLUMNS, rows, PERIOD, {}, overwrite=True) as recorder:
                simulated = simulate(Settings(), what, recorder).simulated

        return timed(run, repeats), simulated


def command(*arguments: str) -> float | None:
    """Median wall time [s] of ``macromicro`` with these arguments; None if it fails."""
    line = [sys.executable, "-m", "macromicro", *arguments]

    def run() -> None:
        subprocess.run(line, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    try:
        return timed(run, 5)
    except (OSError, subprocess.CalledProcessError):
        return None


def lines() -> list[Line]:
    """All figures."""
    one, simulated = integrated(1, 7)
    ten, long = integrated(10, 5)
    found = [
        Line("integrated run, recorded, 1 cycle", "at least 500", simulated / one, "x real time"),
        Line("integrated run, recorded, 10 cycles", "at least 500", long / ten, "x real time"),
        Line("ten-cycle run, already compiled", "at most 5", ten, "s", f"{long:.0f} s simulated"),
    ]
    per = parts.measure()
    for name, ns in per.items():
        remark = f"{REAL_TIME / ns:.0f} x real time" if name == "whole tick" else ""
        found.append(Line(name, "", ns, "ns", remark))
    in_c = parts.macro_in_c()
    ratio = "" if in_c is None else f"the package takes {per['macro physics, moving'] / in_c:.2f} x"
    found.append(Line("macro physics, moving, in C", "", in_c, "ns", ratio or "no C compiler"))
    found += tools.lines(timed, Line)
    found.append(Line("macromicro --help", "below 0.3", command("--help"), "s"))
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("run", "--out", str(Path(folder) / "run"), "--overwrite")
        again = command(*arguments)
    found.append(Line("macromicro run, figures and page", "below 4", again, "s", "second run on"))
    return found


def main() -> None:
    """Measure, print, write."""
    found = lines()
    print(f"{'figure':38}{'target':>14}{'measured':>12}")
    for line in found:
        value = "-" if line.measured is None else f"{line.measured:.4g}"
        remark = f"  ({line.remark})" if line.remark else ""
        print(f"{line.figure:38}{line.target:>14}{value:>12} {line.unit}{remark}")
    record = {
        "version": macromicro.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "machine": platform.machine(),
        "figures": [line._asdict() for line in found],
    }
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    print(f"written: {RESULTS}")


if __name__ == "__main__":
    main()
