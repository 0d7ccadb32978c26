"""`loop.c` and `loop_batch.c` as functions of arrays."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from compiling import BATCH, PLAIN, library
from job import Job

_ARRAY, _LONG = ctypes.c_void_p, ctypes.c_long


def _numbers(job: Job) -> Any:
    """The job as `job_t` of job.h."""
    return np.array(job[:11])


class Loop(NamedTuple):
    """A job ready to run in C: `run()` fills `out`, counts and effort by row."""

    run: Callable[[], None]
    out: Any


def loop(job: Job, place: Path) -> Loop:
    """The job in the compiled library `place`."""
    function = ctypes.CDLL(str(place)).closed_loop
    function.argtypes, function.restype = [_ARRAY, _ARRAY, _LONG, _ARRAY, _ARRAY], None
    numbers, aim = _numbers(job), np.full(job.samples, job.target)
    out = np.empty((2, job.samples))
    given = (numbers.ctypes.data, aim.ctypes.data, job.samples, out[0].ctypes.data,
             out[1].ctypes.data)  # fmt: skip

    def run(_keep: Any = (numbers, aim, out)) -> None:  # C has bare addresses of them
        function(*given)

    return Loop(run, out)


def compiled(job: Job, folder: Path, flags: tuple[str, ...] = PLAIN, stem: str = "loop") -> Loop:
    """`loop.c`, compiled into `folder`; raises NoCompilerError."""
    return loop(job, library("loop.c", folder, flags, stem))


def gains(job: Job, variants: int) -> tuple[Any, Any]:
    """Both taps of so many variants, within 30 % of the job's."""
    share = np.random.default_rng(0).uniform(0.7, 1.3, (2, variants))
    return share[0] * job.now, share[1] * job.before


def batch(job: Job, folder: Path, variants: int) -> Callable[[int], Any]:
    """`loop_batch.c`: from a number of threads to last count, highest count and integral of
    the absolute error [counts s] of each variant, (3, variants)."""
    function = ctypes.CDLL(str(library("loop_batch.c", folder, BATCH))).batch
    function.argtypes = [_ARRAY, _ARRAY, _LONG, _ARRAY, _ARRAY, _LONG, ctypes.c_int, *[_ARRAY] * 3]
    function.restype = None
    numbers, aim = _numbers(job), np.full(job.samples, job.target)
    now, before = gains(job, variants)
    found = np.empty((3, variants))

    def run(threads: int) -> Any:
        function(
            numbers.ctypes.data, aim.ctypes.data, job.samples, now.ctypes.data,
            before.ctypes.data, variants, threads, *(row.ctypes.data for row in found),
        )  # fmt: skip
        return found

    return run
