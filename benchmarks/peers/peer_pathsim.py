"""PathSim: sampled blocks for what has memory, `Function` blocks for what has none.

The controller (4.10) is an `FIR` filter of two taps. A sampled block takes the input that it
finds at its event, so the plant updates its state first, with the volts of the period that
ends, and then shows it: its output equation is that of the state after the update, and its
first event is one period after 0. Blocks that are due at once go in the order of the list.
"""

from __future__ import annotations

import math
from typing import Any

import job as common
from job import Job
from peer import Run, main


def prepare(job: Job) -> Run:
    """The diagram, and a run of it from rest."""
    import numpy as np
    from pathsim import Connection, Simulation
    from pathsim.blocks import FIR, Adder, Constant, DiscreteStateSpace, Function, Scope

    a = np.array([[1.0, job.dt], [0.0, -job.a]])
    b, c = np.array([[0.0], [job.b]]), np.array([[1.0, 0.0]])
    plant = DiscreteStateSpace(a, b, c @ a, c @ b, T=job.dt, tau=job.dt)
    encoder, target, error = Function(math.floor), Constant(job.target), Adder("+-")
    controller = FIR([job.now, job.before], T=job.dt)
    output = Function(lambda effort: common.sent(job, effort))
    friction, scope = Function(lambda volts: common.net(job, volts)), Scope()
    diagram = Simulation(
        [plant, encoder, target, error, controller, output, friction, scope],
        [
            Connection(plant, encoder),
            Connection(target, error[0]),
            Connection(encoder, error[1], scope[0]),
            Connection(error, controller),
            Connection(controller, output),
            Connection(output, friction, scope[1]),
            Connection(friction, plant),
        ],
        dt=job.dt,
        log=False,
    )

    def run() -> tuple[Any, Any]:
        diagram.run((job.samples - 1) * job.dt, reset=True)
        _, (counts, volts) = scope.read()
        return counts, volts

    return run


if __name__ == "__main__":
    main(prepare)
