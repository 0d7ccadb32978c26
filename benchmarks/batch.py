"""Speed of batches: the common job in 1000 variants beside C, cost per variant, memory.

C is `peers/loop_batch.c`: gains by variant, last and highest count and the integral of the
absolute error of each. The quick job gives the same three; the whole one gives eight. Least
of turns in alternation, so that a busy machine is busy for both.
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from figures import few, some

PEERS = Path(__file__).resolve().parent / "peers"
VARIANTS, TURNS = 1000, 40
COUNTS = (100, 10_000, 1_000_000)
PATHS = ("controller.now", "controller.before")
SET = 4096  # variants of a streamed set


def variants(n: int) -> Iterator[Any]:
    """`n` pairs of gains within 30 % of the thesis', in sets."""
    from macromicro.batch import Variants
    from macromicro.batch.macro_model import Pd

    rng = np.random.default_rng(0)
    for k in range(0, n, SET):
        share = rng.uniform(0.7, 1.3, (min(SET, n - k), 2))
        yield Variants(PATHS, share * np.array(Pd()[:2]))


def work(n: int, threads: int | None = None, quick: bool = False, length: float = 10.0) -> float:
    """Run `n` variants and give the sum of their overshoots, the rest thrown away."""
    from macromicro import batch
    from macromicro.batch.macro_model import MacroLoop

    job = batch.job("macro-model", quick=quick, tree=MacroLoop(length=length))
    place = [m.name for m in job.metrics].index("overshoot")
    return math.fsum(float(m[:, place].sum()) for _, m in batch.run(job, variants(n), threads))


def in_c(folder: Path) -> Callable[[int], Any] | None:
    """`loop_batch.c` on 1000 variants, by threads; None without a C compiler."""
    sys.path.insert(0, str(PEERS))
    try:
        import c_loop
        import compiling
        import job
    finally:
        sys.path.remove(str(PEERS))
    try:
        return c_loop.batch(job.default(), folder, VARIANTS)
    except compiling.NoCompilerError:
        return None


def least(runs: list[Callable[[], object]], turns: int) -> list[float]:
    """Least wall time [s] of each, taking turns; a first turn is not counted."""
    times = [math.inf] * len(runs)
    for turn in range(few(turns) + 1):
        for k, run in enumerate(runs):
            start = time.perf_counter()
            run()
            taken = time.perf_counter() - start
            times[k] = min(times[k], taken) if turn else times[k]
    return times


def beside_c(turns: int = TURNS) -> list[tuple[str, float, float | None]]:
    """(what, time [ms], ratio to C) of 1000 variants on 1 and 2 threads."""
    found: list[tuple[str, float, float | None]] = []
    with tempfile.TemporaryDirectory() as folder:
        c = in_c(Path(folder))
        for threads in (1, 2):
            runs: list[Callable[[], object]] = [
                lambda n=threads: work(VARIANTS, n),  # type: ignore[misc]
                lambda n=threads: work(VARIANTS, n, True),  # type: ignore[misc]
            ]
            if c is not None:
                runs.append(lambda n=threads: c(n))  # type: ignore[misc]
            times = least(runs, turns)
            names = ("8 metrics", "3 metrics as C", "C with SIMD")
            for name, taken in zip(names, times, strict=False):
                ratio = taken / times[2] if c is not None else None
                found.append((f"1000 variants, {threads} thread(s), {name}", 1e3 * taken, ratio))
    return found


def per_variant(counts: tuple[int, ...] = COUNTS, length: float = 10.0) -> list[tuple[int, float]]:
    """(variants, time [us] of one) on all cores; the large ones are run once."""
    found = []
    for n in counts:
        repeats = few(max(1, min(30, 20_000 // n)))
        work(100, length=length)
        times = []
        for _ in range(repeats):
            start = time.perf_counter()
            work(n, length=length)
            times.append(time.perf_counter() - start)
        found.append((n, 1e6 * min(times) / n))
    return found


def peak_memory(n: int, length: float = 10.0) -> float:
    """Largest resident memory [MB] of a process of its own that runs `n` variants."""
    code = (
        "import re, sys; sys.path.insert(0, sys.argv[1]); import batch as b; "
        "b.work(int(sys.argv[2]), length=float(sys.argv[3])); "
        # Not getrusage, whose maximum a child inherits from a larger parent.
        "print(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1])"
    )
    here = str(Path(__file__).resolve().parent)
    line = [sys.executable, "-c", code, here, str(n), str(length)]
    done = subprocess.run(line, check=True, capture_output=True, text=True)
    return int(done.stdout) / 1024.0


def rows(turns: int = TURNS, counts: tuple[int, ...] = COUNTS) -> list[dict[str, Any]]:
    """All figures: figure, target ("" without one), measured, unit, remark, ratio to C."""
    found = []
    counts = tuple(some(n) for n in counts)
    for name, taken, ratio in beside_c(turns):
        wanted = "2 thread" in name and "metrics as C" in name
        target = "at most 1.5 to C" if wanted else ""
        found.append(_row(name, target, taken, "ms", to_c=ratio))
    for n, cost in per_variant(counts):
        found.append(_row(f"one of {n} variants, all cores", "constant", cost, "us"))
    for n in (counts[0], counts[-1]):
        memory = peak_memory(n)
        found.append(_row(f"peak memory, {n} variants", "bounded", memory, "MB", "whole process"))
    return found


def _row(
    figure: str,
    target: str,
    measured: float,
    unit: str,
    remark: str = "",
    to_c: float | None = None,
) -> dict[str, Any]:
    keys = ("figure", "target", "measured", "unit", "remark", "to_c")
    return dict(zip(keys, (figure, target, measured, unit, remark, to_c), strict=True))


if __name__ == "__main__":
    for row in rows():
        print(
            f"{row['figure']:48}{row['measured']:10.4g} {row['unit']:4}{row['target']:22}"
            f"{row['to_c'] or ''} {row['remark']}"
        )
