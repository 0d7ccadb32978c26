"""The package's own loop of the common job, exported as C (`macromicro.export`)."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
from c_loop import Loop
from compiling import library
from job import Job
from rollout import arguments

from macromicro.export import files
from macromicro.export.kinds import REAL, Rows
from macromicro.export.units import Entry, Unit
from macromicro.models import macro

_CALL = """
void run(const double *reference, double (*out)[{n}])
{{
    job_run(&job_model, &job_law, &job_first, reference, true, out);
}}
"""


def loop(job: Job, folder: Path) -> Loop:
    """`models.macro.rollout` in C, compiled into `folder`; raises NoCompilerError."""
    model, law, first, reference, counted = arguments(job)
    n = job.samples
    entry = Entry("run", macro.rollout, (model, law, first, Rows(REAL, (n,)), counted,
                                         Rows(REAL, (2, n))))  # fmt: skip
    given = {"model": model, "law": law, "first": first}
    written = files.written(Unit("job", "the common job", (entry,), given))
    (folder / "job.h").write_text(written.header)
    place = folder / "job_exported.c"
    place.write_text(written.code + _CALL.format(n=n))
    function = ctypes.CDLL(str(library(str(place), folder))).run
    function.argtypes, function.restype = [ctypes.c_void_p] * 2, None
    out = np.empty((2, n))

    def run(_keep: Any = (reference, out)) -> None:  # C has bare addresses of them
        function(reference.ctypes.data, out.ctypes.data)

    return Loop(run, out)
