"""Random axes for `make_commissioning`."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import commissioning
import numpy as np

from macromicro.commission import axis
from macromicro.commission.running import Commissioned
from macromicro.machines import sheets


def figures(random: np.random.Generator) -> dict[str, Any]:
    """Data-sheet figures over wide ranges."""
    between = partial(commissioning.between, random)
    supply = float(random.choice([12.0, 24.0, 48.0]))
    resistance = between(0.5, 12.0)
    kind = str(random.choice(["belt", "screw", "linear"]))
    constant, force = between(0.01, 0.1), between(5.0, 40.0)
    radius, lead = between(4e-3, 15e-3), between(2e-3, 10e-3)
    current = supply / resistance * between(0.3, 1.5)
    push = {"belt": constant / radius, "screw": constant * 2.0 * math.pi / lead, "linear": force}
    most = push[kind] * min(current, supply / resistance)
    coulomb = most * between(0.02, 0.2)
    travel = between(0.05, 0.4)
    pitch = between(0.2e-6, 20e-6)
    period = float(random.choice([0.25e-3, 0.5e-3, 1e-3]))
    per_turn = 2.0 * math.pi * radius if kind == "belt" else lead
    return {
        "amplifier.mode": "voltage",
        "amplifier.supply": f"{supply!r} V",
        "amplifier.current": f"{current!r} A",
        "motor.constant": f"{constant!r} N*m/A",
        "motor.force": f"{force!r} N/A",
        "motor.resistance": f"{resistance!r} ohm",
        "motor.inductance": f"{resistance * between(0.05e-3, 0.8e-3)!r} H",
        "motor.inertia": f"{between(5e-7, 2e-5)!r} kg*m^2",
        "drive.kind": kind,
        "drive.radius": f"{radius!r} m",
        "drive.lead": f"{lead!r} m",
        "load.mass": f"{between(0.2, 5.0)!r} kg",
        "load.stop_low": f"{-between(0.1, 0.4) * travel!r} m",
        "load.stop_high": f"{travel!r} m",
        "friction.coulomb": f"{coulomb!r} N",
        "friction.stribeck": f"{coulomb * between(0.02, 0.4)!r} N",
        "friction.stribeck_speed": f"{between(1e-3, 30e-3)!r} m/s",
        "friction.viscous": f"{most * between(0.02, 0.3)!r} N*s/m",
        "friction.presliding": f"{between(1e-6, 10e-6)!r} m",
        "friction.ripple": f"{coulomb * between(0.005, 0.08)!r} N",
        "friction.ripple_long": f"{between(20e-3, 80e-3)!r} m",
        "friction.ripple_short": f"{between(5e-3, 20e-3)!r} m",
        "encoder.at": str(random.choice(["motor", "load"])) if kind != "linear" else "load",
        "encoder.lines": max(round(per_turn / pitch / 4.0), 16) * 1.0,
        "encoder.pitch": f"{pitch!r} m",
        "timing.period": f"{period!r} s",
        "timing.delay": f"{random.uniform(0.05, 1.0) * period!r} s",
    }


def truth(tree: Any, found: Commissioned) -> dict[str, float]:
    """What the model's parameters are, in volts and metres, by the axis' figures."""
    del found
    per_newton = sheets.per_newton(tree)
    emf = sheets.constant(tree) / tree.amplifier.gain
    return {
        "mass": per_newton * sheets.mass(tree),
        "viscous": emf + per_newton * tree.friction.viscous,
        "coulomb": per_newton * tree.friction.coulomb,
    }


def hanging(random: np.random.Generator) -> dict[str, Any]:
    """The same on a slope, without anything that balances the load."""
    slope = random.uniform(20.0, 90.0) * float(random.choice([-1.0, 1.0]))
    return {**figures(random), "load.incline": f"{slope!r} deg"}


def weighed(tree: Any, found: Commissioned) -> dict[str, float]:
    """As `truth`, with the weight."""
    force = sheets.per_newton(tree) * sheets.weight(tree)
    return {**truth(tree, found), "offset": force}


DRAWN = commissioning.of_figures(axis.KIND, figures, truth, 100, 2027)
HANGING = commissioning.of_figures(axis.KIND, hanging, weighed, 100, 2030)
