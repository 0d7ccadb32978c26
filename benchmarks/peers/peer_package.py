"""The package: `models.macro.closed_loop`, its machine code taken from the cache."""

from __future__ import annotations

from typing import Any

from job import Job
from peer import Run, main


def prepare(job: Job) -> Run:
    """One call a run, arrays and checks included."""
    import numpy as np
    from loops import parts

    from macromicro.models import macro

    model, law = parts(job)
    aim = np.full(job.samples, job.target)

    def run() -> tuple[Any, Any]:
        return macro.closed_loop(model, law, aim, counted=True)

    return run


if __name__ == "__main__":
    main(prepare)
