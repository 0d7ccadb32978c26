"""Random shape-memory wires for `make_commissioning`."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import commissioning
import numpy as np

from macromicro.commission import wire
from macromicro.commission.running import Commissioned
from macromicro.machines import wire as machine
from macromicro.machines import wire_sheets


def figures(random: np.random.Generator) -> dict[str, Any]:
    """Data-sheet figures after Dynalloy's table of wires, and what none prints."""
    between = partial(commissioning.between, random)
    diameter = between(0.08e-3, 0.3e-3)
    area = 0.25 * math.pi * diameter**2
    length = between(0.05, 0.25)
    pull = 178e6 * area  # N; all of Dynalloy's wires pull 172 MPa or some more
    way = 0.04 * length
    preload = pull * between(0.42, 0.6)
    # As Dynalloy's table: the cooling time goes with the diameter to the power 1.7.
    cooling = 4.5 * (diameter / 0.25e-3) ** 1.7 * between(0.8, 1.2)
    # The current of Dynalloy's table contracts a wire within a second.
    current = 1.05 * (diameter / 0.25e-3) ** 1.8 * between(0.95, 1.3)
    return {
        "driver.current": f"{current!r} A",
        "wire.diameter": f"{diameter!r} m",
        "wire.length": f"{length!r} m",
        "wire.resistance": f"{18.5 * (0.25e-3 / diameter) ** 2!r} ohm/m",
        "wire.pull": f"{pull!r} N",
        "wire.stretch": f"{0.4 * pull!r} N",
        "wire.cooling": f"{cooling!r} s",
        "bias.preload": f"{preload!r} N",
        "bias.rate": f"{(pull - preload) / way * between(0.05, 0.5)!r} N/m",
        "bias.mass": f"{pull * between(5e-3, 2e-2)!r} kg",
        "hidden.capacity": between(0.85, 1.2),
        "hidden.latent": between(0.8, 1.2),
        "hidden.cooling": between(0.85, 1.2),
        "hidden.fold": f"{between(4.0, 12.0)!r} K",
        "hidden.scatter": f"{between(2.0, 6.0)!r} K",
        "air.ambient": f"{random.uniform(17.0, 27.0)!r} degC",
        "encoder.noise": f"{way * between(2e-5, 5e-4)!r} m",
        "encoder.pitch": f"{way * between(1e-5, 3e-4)!r} m",
        "encoder.high": f"{2.0 * way!r} m",
    }


def truth(tree: Any, found: Commissioned) -> dict[str, float]:
    """What the estimates are, by the wire's figures."""
    del found
    thermal = machine.prepare(tree).micro.thermal
    heats, hidden = wire_sheets.heats(tree), tree.hidden
    way = wire_sheets.way(tree)
    rise = tree.wire.heat_end - tree.wire.heat_start
    rise += wire_sheets.rate(tree) * way / (wire_sheets.STIFFENING * wire_sheets.area(tree))
    taken = hidden.latent * heats.latent + hidden.capacity * heats.capacity * rise
    return {
        "way": way,
        "up": wire_sheets.power(tree) / tree.driver.full_scale * way / taken,
        "tau": thermal[1] * thermal[2],
    }


DRAWN = commissioning.of_figures(wire.KIND, figures, truth, 100, 2029)
