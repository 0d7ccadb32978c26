"""Plain Python: the package's own kernels, interpreted."""

from __future__ import annotations

from typing import Any

from job import Job
from peer import Run, main


def prepare(job: Job) -> Run:
    """The kernels without the compiler."""
    import numpy as np
    from loops import arguments

    from macromicro.models import macro

    given = arguments(job)

    def run() -> tuple[Any, Any]:
        out = np.empty((2, job.samples))
        macro.rollout(*given, out)
        return out[0], out[1]

    return run


if __name__ == "__main__":
    main(prepare)
