"""bdsim: a diagram with one clock of 1 kHz; its sampled blocks have the memory.

`LTI_SS_S` is the plant, `ZOH` the delay of the error (its output is the last input). The
record has the start twice: at 0, and as what the first tick, a period later, finds.
"""

from __future__ import annotations

import math
from typing import Any

import job as common
from job import Job
from peer import Run, main


def prepare(job: Job) -> Run:
    """The diagram, and a run of it from rest."""
    import bdsim
    import numpy as np

    sim = bdsim.BDSim(graphics=False, progress=False, banner=False)
    diagram = sim.blockdiagram()
    clock = diagram.clock(job.dt, unit="s")
    a = np.array([[1.0, job.dt], [0.0, -job.a]])
    plant = diagram.LTI_SS_S(clock, A=a, B=np.array([0.0, job.b]), C=np.array([1.0, 0.0]))
    target, error = diagram.CONSTANT(job.target), diagram.SUM("+-")
    encoder, last = diagram.FUNCTION(lambda x: math.floor(float(x))), diagram.ZOH(clock)
    controller = diagram.FUNCTION(
        lambda now, before: common.effort(job, float(now), float(before)), nin=2
    )
    friction = diagram.FUNCTION(lambda volts: common.net(job, volts))
    diagram.connect(plant, encoder)
    diagram.connect(target, error[0])
    diagram.connect(encoder, error[1])
    diagram.connect(error, controller[0], last)
    diagram.connect(last, controller[1])
    diagram.connect(controller, friction)
    diagram.connect(friction, plant)
    diagram.compile()

    def run() -> tuple[Any, Any]:
        found = sim.run(diagram, T=job.samples * job.dt, watch=[encoder, controller])
        return found.y0[1:], found.y1[1:]

    return run


if __name__ == "__main__":
    main(prepare)
