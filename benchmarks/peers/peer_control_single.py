"""python-control again, the whole loop written as the update and output of one `nlsys`.

Less of a block diagram than `peer_control`, but the least that the package has to do.
"""

from __future__ import annotations

import math
from typing import Any

import job as common
from job import Job
from peer import Run, main


def prepare(job: Job) -> Run:
    """States: position, speed, last error."""
    import numpy as np

    import control as ct

    def volts(state: Any, target: float) -> tuple[int, float]:
        seen = math.floor(state[0])
        return seen, common.effort(job, target - seen, state[2])

    def update(t: float, state: Any, u: Any, p: Any) -> Any:
        seen, sent = volts(state, u[0])
        x = state[0] + job.dt * state[1]
        v = job.b * common.net(job, sent) - job.a * state[1]
        return np.array([x, v, u[0] - seen])

    loop = ct.nlsys(
        update,
        lambda t, state, u, p: np.array(volts(state, u[0])),
        states=3,
        inputs=["target"],
        outputs=["counts", "volts"],
        dt=job.dt,
    )
    times = np.arange(job.samples) * job.dt
    target = np.full(job.samples, job.target)

    def run() -> tuple[Any, Any]:
        found = ct.input_output_response(loop, times, target)
        return found.outputs[0], found.outputs[1]

    return run


if __name__ == "__main__":
    main(prepare)
