"""C: `loop.c`, compiled on the spot (the cold time has the compiler in it)."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from compiling import library
from job import Job
from loops import in_c
from peer import Run, main


def prepare(job: Job) -> Run:
    """The loop in a fresh library."""
    made = in_c(job, library("loop.c", Path(tempfile.mkdtemp())))

    def run() -> tuple[Any, Any]:
        made.run()
        return made.out[0], made.out[1]

    return run


if __name__ == "__main__":
    main(prepare)
