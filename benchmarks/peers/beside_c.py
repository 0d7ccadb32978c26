"""The package's compiled loop beside C, in one process and turn by turn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import c_loop
import exported
import numpy as np
from compiling import NATIVE
from job import Job
from rollout import arguments, parts
from timing import alternating

from macromicro.kernel import compiled
from macromicro.models import macro

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


def show(record: dict[str, Any]) -> None:
    """The two tables."""
    print(f"\n{'one job, turn by turn':28}{'median':>10}{'least':>10}{'to C':>8}{'to native':>11}")
    for row in record["beside_c"]:
        print(
            f"{row['what']:28}{1e6 * row['median']:7.1f} us{1e6 * row['least']:7.1f} us"
            f"{row['ratio_of_least']:8.2f}{row['ratio_to_native']:11.2f}   off by "
            f"{row['counts_off']:g} counts, {row['volts_off']:g} V"
        )
    print(f"\n{'Preisach, samples/s':28}{'run':>10}{'kernel':>10}{'C':>10}{'C native':>10}")
    for row in record["preisach"]:
        best = [row[key][1] for key in ("run", "kernel", "c", "c_native")]
        print(
            f"{row['signal']:28}" + "".join(f"{rate:10.3g}" for rate in best)
            + f"   C over run {best[2] / best[0]:.2f}, over kernel {best[2] / best[1]:.2f}"
            + f", native over kernel {best[3] / best[1]:.2f}; off by {row['difference']:g}"
        )  # fmt: skip
