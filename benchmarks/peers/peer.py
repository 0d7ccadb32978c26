"""What every peer does around its simulation: time it, and leave the trajectory behind.

    python <peer>.py JOB.json OUT.npy TIMES.json

`prepare(job)` imports the peer, builds the model and returns a function that simulates it
from rest once and returns counts and effort, a sample a period each.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from job import Job, read

Run = Callable[[], tuple[Any, Any]]
SECONDS = 8.0  # of warm runs, at least
FEWEST, MOST = 5, 50


def main(prepare: Callable[[Job], Run]) -> None:
    """Measure the peer whose `prepare` this is; what it prints itself is nobody's business."""
    job = read(Path(sys.argv[1]))
    start = time.perf_counter()
    run = prepare(job)
    built = time.perf_counter()
    counts, effort = run()
    cold = time.perf_counter()
    warm: list[float] = []
    busy: list[float] = []
    while len(warm) < FEWEST or (sum(warm) < SECONDS and len(warm) < MOST):
        begun, worked = time.perf_counter(), time.process_time()
        counts, effort = run()
        busy.append(time.process_time() - worked)
        warm.append(time.perf_counter() - begun)
    trajectory = np.array([np.ravel(counts), np.ravel(effort)], dtype=np.float64)
    np.save(sys.argv[2], trajectory[:, : job.samples])
    times = {
        "building": built - start,
        "cold": cold - start,
        "warm": median(warm),
        "least": min(warm),
        "busy": median(busy),
        "runs": len(warm),
    }
    Path(sys.argv[3]).write_text(json.dumps(times), encoding="utf-8")
