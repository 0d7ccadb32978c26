"""A sweep by one local worker and by two, in processes, parts and results included."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from figures import Line, few, some

SPEC = """
job = "macro-bench"
method = "sobol"
samples = {samples}
seed = 1

[parameters.bench.friction]
coulomb = {{ low = "8 N", high = "13 N" }}
viscous = {{ low = "4 N*s/m", high = "9 N*s/m" }}
"""
SAMPLES, TURNS = 4096, 2


def swept(workers: int, folder: Path) -> float | str:
    """Wall time [s] of the whole command; what it said, if it fails."""
    spec = folder / "spec.toml"
    spec.write_text(SPEC.format(samples=some(SAMPLES)), encoding="utf-8")
    line = [sys.executable, "-m", "macromicro", "sweep", str(spec), "--workers", str(workers)]
    start = time.perf_counter()
    done = subprocess.run(
        [*line, "--out", str(folder / "out"), "--overwrite"],
        capture_output=True,
        text=True,
        check=False,
    )
    return time.perf_counter() - start if done.returncode == 0 else done.stderr.strip()


def lines() -> list[Line]:
    """One worker against two, turn by turn, the best of each."""
    times: dict[int, list[float]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as name:
        for _ in range(few(TURNS)):
            for workers, taken in times.items():
                seconds = swept(workers, Path(name))
                if isinstance(seconds, str):
                    return [Line("sweep by two workers", "at least 1.8", None, "", seconds)]
                taken.append(seconds)
    one, two = (min(t) for t in times.values())
    remark = (
        f"{some(SAMPLES)} runs of 10 s on the bench: {one:.1f} s and {two:.1f} s, start included"
    )
    return [Line("sweep by two workers", "at least 1.8", one / two, "x one", remark)]
