"""The package's compiled loop beside C, in one process and turn by turn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import c_loop
import exported
import numpy as np
from compiling import NATIVE, library
from job import Job
from rollout import arguments, parts
from timing import alternating

from macromicro.kernel import compiled
from macromicro.models import macro

VARIANTS = 1000
REFERENCE = "C, cc -O3"


def measure(job: Job, folder: Path, repeats: int = 300) -> list[dict[str, Any]]:
    """Times [s] of C and the package, their ratio to the reference, largest differences."""
    plain = c_loop.compiled(job, folder)
    native = c_loop.compiled(job, folder, NATIVE, "loop_native")
    written = exported.loop(job, folder)
    given, (model, law) = arguments(job), parts(job)
    aim, out = given[3], np.empty((2, job.samples))
    runs: dict[str, Callable[[], Any]] = {
        REFERENCE: plain.run,
        "C, cc -O3 -march=native": native.run,
        "macromicro, exported C": written.run,
        "macromicro, kernel": lambda: compiled(macro.rollout)(*given, out),
        "macromicro, closed_loop": lambda: macro.closed_loop(model, law, aim, counted=True),
    }
    times = alternating(list(runs.values()), repeats)
    trajectories = (
        plain.out,
        native.out,
        written.out,
        out,
        np.array(runs["macromicro, closed_loop"]()),
    )
    found = []
    for name, taken, seen in zip(runs, times, trajectories, strict=True):
        by_median = median(taken) / median(times[0])
        by_least = min(taken) / min(times[0])
        counts, effort = np.abs(seen - plain.out).max(axis=1).tolist()
        found.append(
            {"what": name, "median": median(taken), "least": min(taken),
             "ratio_of_medians": by_median, "ratio_of_least": by_least,
             "ratio_to_native": min(taken) / min(times[1]),
             "counts_off": counts, "volts_off": effort}
        )  # fmt: skip
    return found


def batches(job: Job, folder: Path, repeats: int = 25) -> list[dict[str, Any]]:
    """Times [s] of `VARIANTS` jobs with other gains in C, and whether each agrees with loop.c."""
    run = c_loop.batch(job, folder, VARIANTS)
    now, before = c_loop.gains(job, VARIANTS)
    found = run(2).copy()
    off = 0
    place = library("loop.c", folder)
    for k in range(VARIANTS):
        one = c_loop.loop(job._replace(now=now[k], before=before[k]), place)
        one.run()
        off += not np.array_equal(found[:, k], summary(job, one.out[0]))
    times = alternating([lambda: run(1), lambda: run(2)], repeats)
    return [
        {"threads": n, "variants": VARIANTS, "median": median(t), "least": min(t), "differing": off}
        for n, t in zip((1, 2), times, strict=True)
    ]


def summary(job: Job, counts: Any) -> Any:
    """What `loop_batch.c` tells of a run: last and highest count, integral of |error|.

    The sum is added up sample by sample, as there.
    """
    return np.array(
        [counts[-1], max(counts.max(), 0.0), np.abs(job.target - counts).cumsum()[-1] * job.dt]
    )


def show(record: dict[str, Any]) -> None:
    """The three tables."""
    print(f"\n{'one job, turn by turn':28}{'median':>10}{'least':>10}{'to C':>8}{'to native':>11}")
    for row in record["beside_c"]:
        print(
            f"{row['what']:28}{1e6 * row['median']:7.1f} us{1e6 * row['least']:7.1f} us"
            f"{row['ratio_of_least']:8.2f}{row['ratio_to_native']:11.2f}   off by "
            f"{row['counts_off']:g} counts, {row['volts_off']:g} V"
        )
    for row in record["batch"]:
        print(
            f"C, {row['variants']} variants, {row['threads']} thread(s): median "
            f"{1e3 * row['median']:.2f} ms, least {1e3 * row['least']:.2f} ms; "
            f"{row['differing']} differ from loop.c"
        )
    print(f"\n{'Preisach, samples/s':28}{'run':>10}{'kernel':>10}{'C':>10}{'C native':>10}")
    for row in record["preisach"]:
        best = [row[key][1] for key in ("run", "kernel", "c", "c_native")]
        print(
            f"{row['signal']:28}" + "".join(f"{rate:10.3g}" for rate in best)
            + f"   C over run {best[2] / best[0]:.2f}, over kernel {best[2] / best[1]:.2f}"
            + f", native over kernel {best[3] / best[1]:.2f}; off by {row['difference']:g}"
        )  # fmt: skip
