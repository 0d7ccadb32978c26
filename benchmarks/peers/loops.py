"""The common job by the package, by C, and by C that the package exports, in one process."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from compiling import NATIVE, PLAIN, library
from job import Job

from macromicro.arrays import Array
from macromicro.control import settings
from macromicro.control.macro import MacroLaw
from macromicro.control.pd import PdTuned
from macromicro.control.settings import Control
from macromicro.export import files
from macromicro.export.kinds import REAL, Rows
from macromicro.export.units import Entry, Unit
from macromicro.kernel import compiled
from macromicro.models import macro
from macromicro.models.macro import TUNED, Linear, MacroModel, MacroModelState

REFERENCE = "C, cc -O3"
_CALL = """
void run(const double *reference, double (*out)[{n}])
{{
    job_run(&job_model, &job_law, &job_first, reference, true, out);
}}
"""


def parts(job: Job) -> tuple[MacroModel, MacroLaw]:
    """The job as the package's model and law."""
    model = MacroModel(Linear(job.a, job.b, job.dt), TUNED, job.zone, job.a0, job.delta, job.rail)
    law = settings.prepare(Control(macro_law="pd-tuned")).macro
    tuned = PdTuned(job.now, job.before)
    return model, law.with_gains(tuned)._replace(dead_zone=job.width, limit=job.limit)


def arguments(job: Job) -> tuple[MacroModel, MacroLaw, MacroModelState, Array, bool]:
    """What `models.macro.rollout` takes, but for the array of results."""
    return *parts(job), MacroModelState(0.0, 0.0), np.full(job.samples, job.target), True


class Loop(NamedTuple):
    """A job ready to run in C: `run()` fills `out`, counts and effort by row."""

    run: Callable[[], None]
    out: Any


def in_c(job: Job, place: Path) -> Loop:
    """The job in the compiled library `place` of `loop.c`."""
    function = ctypes.CDLL(str(place)).closed_loop
    array, whole = ctypes.c_void_p, ctypes.c_long
    function.argtypes, function.restype = [array, array, whole, array, array], None
    numbers = np.array(job[:11])  # `job_t` of job.h
    aim, out = np.full(job.samples, job.target), np.empty((2, job.samples))
    given = (numbers.ctypes.data, aim.ctypes.data, job.samples, out[0].ctypes.data,
             out[1].ctypes.data)  # fmt: skip

    def run(_keep: Any = (numbers, aim, out)) -> None:  # C has bare addresses of them
        function(*given)

    return Loop(run, out)


def exported(job: Job, folder: Path) -> Loop:
    """`models.macro.rollout` in C, compiled into `folder`; raises NoCompilerError."""
    model, law, first, reference, counted = arguments(job)
    n = job.samples
    entry = Entry("run", macro.rollout, (model, law, first, Rows(REAL, (n,)), counted,
                                         Rows(REAL, (2, n))))  # fmt: skip
    given = {"model": model, "law": law, "first": first}
    written = files.write_unit(Unit("job", "the common job", (entry,), given))
    (folder / "job.h").write_text(written.header)
    place = folder / "job_exported.c"
    place.write_text(written.code + _CALL.format(n=n))
    function = ctypes.CDLL(str(library(str(place), folder))).run
    function.argtypes, function.restype = [ctypes.c_void_p] * 2, None
    out = np.empty((2, n))

    def run(_keep: Any = (reference, out)) -> None:  # C has bare addresses of them
        function(reference.ctypes.data, out.ctypes.data)

    return Loop(run, out)


def measure(job: Job, folder: Path, repeats: int = 300) -> list[dict[str, Any]]:
    """Times [s] of C and the package, their ratio to the reference, largest differences."""
    plain = in_c(job, library("loop.c", folder, PLAIN))
    native = in_c(job, library("loop.c", folder, NATIVE, "loop_native"))
    written = exported(job, folder)
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


def alternating(runs: Sequence[Callable[[], object]], repeats: int) -> list[list[float]]:
    """Times [s] of each, `repeats` of them; a first round is not counted. They take turns, so that
    a busy machine is busy for all of them."""
    times: list[list[float]] = [[] for _ in runs]
    for k in range(repeats + 1):
        for run, kept in zip(runs, times, strict=True):
            start = time.perf_counter()
            run()
            if k:
                kept.append(time.perf_counter() - start)
    return times
