"""`loop.c` as a function of arrays."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from compiling import PLAIN, library
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
