"""jaxonomy: a diagram of discrete blocks, traced and compiled by JAX.

(4.10) and the plant are `LTISystemDiscrete`, what has no memory is a `FeedthroughBlock`. The
controller's and the friction's branches are `where`, for JAX traces both sides. `simulate`
keeps what it compiled for a diagram, so only the first run compiles.
"""

from __future__ import annotations

import itertools
from typing import Any

from job import Job
from peer import Run, main


def prepare(job: Job) -> Run:
    """The diagram, and a run of it from rest."""
    import jaxonomy
    import numpy as np
    from jax import numpy as jnp
    from jaxonomy.library import Adder, Constant, FeedthroughBlock, LTISystemDiscrete

    def sent(u: Any) -> Any:
        lifted = u + jnp.where(u == 0.0, 0.0, jnp.copysign(job.width, u))
        return jnp.clip(lifted, -job.limit, job.limit)

    def net(volts: Any) -> Any:
        u = jnp.clip(volts, -job.rail, job.rail)
        size = jnp.abs(u) - job.zone
        return jnp.where(size > 0.0, jnp.copysign(job.a0 + job.delta * size, u), 0.0)

    builder = jaxonomy.DiagramBuilder()
    a, b = np.array([[1.0, job.dt], [0.0, -job.a]]), np.array([[0.0], [job.b]])
    taps = np.zeros((1, 1)), np.ones((1, 1)), np.array([[job.before]]), np.array([[job.now]])
    plant, encoder, target, error, controller, output, friction = builder.add(
        LTISystemDiscrete(a, b, np.array([[1.0, 0.0]]), np.zeros((1, 1)), job.dt, np.zeros(2)),
        FeedthroughBlock(jnp.floor),
        Constant(job.target),
        Adder(2, operators="+-"),
        LTISystemDiscrete(*taps, job.dt, np.zeros(1)),
        FeedthroughBlock(sent),
        FeedthroughBlock(net),
    )
    builder.connect(target.output_ports[0], error.input_ports[0])
    builder.connect(encoder.output_ports[0], error.input_ports[1])
    builder.connect(plant.output_ports[0], encoder.input_ports[0])
    for one, other in itertools.pairwise((error, controller, output, friction, plant)):
        builder.connect(one.output_ports[0], other.input_ports[0])
    diagram = builder.build()
    context = diagram.create_context()
    recorded = {"counts": encoder.output_ports[0], "volts": output.output_ports[0]}
    end = (job.samples - 1) * job.dt

    def run() -> tuple[Any, Any]:
        found = jaxonomy.simulate(diagram, context, (0.0, end), recorded_signals=recorded)
        return found.outputs["counts"], found.outputs["volts"]

    return run


if __name__ == "__main__":
    main(prepare)
