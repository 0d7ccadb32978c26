"""python-control: an interconnected discrete-time system, simulated by `input_output_response`.

So its manual treats nonlinear loops: the plant as a state-space system, the controller with
its one state and the friction as `nlsys`, wired by name with `interconnect`.
"""

from __future__ import annotations

import math
from typing import Any

import job as common
from job import Job
from peer import Run, main


def prepare(job: Job) -> Run:
    """The loop from target to counts and effort."""
    import numpy as np

    import control as ct

    plant = ct.ss(
        [[1.0, job.dt], [0.0, -job.a]], [[0.0], [job.b]], [[1.0, 0.0]], [[0.0]], job.dt,
        name="plant", inputs="net", outputs="x",
    )  # fmt: skip
    encoder = ct.nlsys(
        None,
        lambda t, s, u, p: math.floor(u[0]),
        name="encoder",
        inputs="x",
        outputs="counts",
        dt=job.dt,
    )
    controller = ct.nlsys(
        lambda t, s, u, p: np.array([u[0] - u[1]]),
        lambda t, s, u, p: common.effort(job, u[0] - u[1], s[0]),
        name="controller",
        states=1,
        inputs=["target", "counts"],
        outputs="volts",
        dt=job.dt,
    )
    friction = ct.nlsys(
        None,
        lambda t, s, u, p: common.net(job, u[0]),
        name="friction",
        inputs="volts",
        outputs="net",
        dt=job.dt,
    )
    loop = ct.interconnect(
        [plant, encoder, controller, friction], inputs="target", outputs=["counts", "volts"]
    )
    times = np.arange(job.samples) * job.dt
    target = np.full(job.samples, job.target)

    def run() -> tuple[Any, Any]:
        found = ct.input_output_response(loop, times, target)
        return found.outputs[0], found.outputs[1]

    return run


if __name__ == "__main__":
    main(prepare)
