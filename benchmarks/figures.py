"""What the benchmarks share: a figure as data, timing, turns in alternation."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

# Those of the peers find each other in their folder.
sys.path.append(str(Path(__file__).resolve().parent / "peers"))


class Scale:
    """How much is measured. `quick`: once and little, only to see that it runs."""

    quick = False


def few(repeats: int) -> int:
    """So many repeats, or one."""
    return 1 if Scale.quick else repeats


def some(number: int) -> int:
    """So much work, or a hundredth of it."""
    return max(number // 100, 1) if Scale.quick else number


class Line(NamedTuple):
    """A figure: what, target as text ("" without one), measured (None: not), unit, remark;
    `to_c`: the same divided by what C takes for it on this machine, in the same run."""

    figure: str
    target: str
    measured: float | None
    unit: str
    remark: str = ""
    to_c: float | None = None


_GOAL = re.compile(r"(at least|at most|below) ([0-9.e+-]+)( to C)?")


def met(line: Line) -> bool | None:
    """Does it reach its target? None without one, or where nothing was measured."""
    found = []
    for goal, text, to_c in _GOAL.findall(line.target):
        value = line.to_c if to_c else line.measured
        if value is None:
            return None
        limit = float(text)
        found.append(value >= limit if goal == "at least" else value <= limit)
    return all(found) if found else None


def times(run: Callable[[], object], repeats: int) -> list[float]:
    """Wall times [s] of `run`."""
    found = []
    for _ in range(few(repeats)):
        start = time.perf_counter()
        run()
        found.append(time.perf_counter() - start)
    return found


def timed(run: Callable[[], object], repeats: int) -> float:
    """Median wall time [s] of `run` after one run that is not counted."""
    run()
    return median(times(run, repeats))


def table(lines: Sequence[Line]) -> str:
    """As text."""
    head = f"{'figure':52}{'target':>34} {'':7}{'measured':>11} {'unit':11}{'to C':>6}"
    rows = [head]
    for line in lines:
        value = "-" if line.measured is None else f"{line.measured:.4g}"
        ratio = "" if line.to_c is None else f"{line.to_c:.2f}"
        verdict = {True: "met", False: "missed", None: ""}[met(line)]
        rows.append(
            f"{line.figure:52}{line.target:>34} {verdict:7}{value:>11} {line.unit:11}{ratio:>6}"
            f"{'  ' if line.remark else ''}{line.remark}"
        )
    return "\n".join(rows)
