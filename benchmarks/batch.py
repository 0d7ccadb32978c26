"""Cost of one variant in a batch of the macro-stage's bench, and the memory of many."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from figures import Line, some, times

COUNTS = (100, 1000, 10_000)
PATHS = ("controller.pd_tuned.now", "controller.pd_tuned.before")
SET = 1024  # variants of a streamed set


def variants(n: int) -> Iterator[Any]:
    """`n` pairs of gains within 30 % of the thesis', in sets."""
    from macromicro.batch import Variants
    from macromicro.control.pd import PdTuned

    rng = np.random.default_rng(0)
    for k in range(0, n, SET):
        share = rng.uniform(0.7, 1.3, (min(SET, n - k), 2))
        yield Variants(PATHS, share * np.array(PdTuned()))


def work(n: int, length: float = 2.0) -> float:
    """Run `n` variants and give the sum of their overshoots, the rest thrown away."""
    from macromicro import batch

    job = batch.job("macro-bench", length=length)
    place = [m.name for m in job.metrics].index("overshoot")
    return math.fsum(float(m[:, place].sum()) for _, m in batch.run(job, variants(n)))


def per_variant(counts: tuple[int, ...] = COUNTS) -> list[tuple[int, float]]:
    """(variants, time [us] of one) on all cores; the large ones are run once."""
    found = []
    for n in counts:
        work(100)
        least = min(times(partial(work, n), max(1, 1000 // n)))
        found.append((n, 1e6 * least / n))
    return found


def peak_memory(n: int) -> float:
    """Largest resident memory [MB] of a process of its own that runs `n` variants."""
    code = (
        "import re, sys; sys.path.insert(0, sys.argv[1]); import batch as b; "
        "b.work(int(sys.argv[2]), 0.1); "
        # Not getrusage, whose maximum a child inherits from a larger parent.
        "print(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1])"
    )
    line = [sys.executable, "-c", code, str(Path(__file__).resolve().parent), str(n)]
    done = subprocess.run(line, check=True, capture_output=True, text=True)
    return int(done.stdout) / 1024.0


def lines() -> list[Line]:
    counts = tuple(some(n) for n in COUNTS)
    costs = [
        Line(f"one of {n} variants of 2 s, all cores", "constant", cost, "us", "")
        for n, cost in per_variant(counts)
    ]
    memory = [
        Line(f"peak memory, {n} variants", "bounded", peak_memory(n), "MB", "whole process")
        for n in (counts[0], counts[-1])
    ]
    return [*costs, *memory]
