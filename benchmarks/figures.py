"""What the benchmarks share: a figure as data, timing, turns in alternation."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from statistics import median
from typing import NamedTuple


class Line(NamedTuple):
    """A figure: what, target as text ("" without one), measured (None: not), unit, remark;
    `to_c`: the same divided by what C takes for it on this machine, in the same run."""

    figure: str
    target: str
    measured: float | None
    unit: str
    remark: str = ""
    to_c: float | None = None


def timed(run: Callable[[], object], repeats: int) -> float:
    """Median wall time [s] of `run` after one run that is not counted."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return median(times)


def table(lines: Sequence[Line]) -> str:
    """As text."""
    rows = [f"{'figure':52}{'target':>22}{'measured':>12} {'unit':12}{'to C':>6}"]
    for line in lines:
        value = "-" if line.measured is None else f"{line.measured:.4g}"
        ratio = "" if line.to_c is None else f"{line.to_c:.2f}"
        remark = f"  {line.remark}" if line.remark else ""
        rows.append(
            f"{line.figure:52}{line.target:>22}{value:>12} {line.unit:12}{ratio:>6}{remark}"
        )
    return "\n".join(rows)
