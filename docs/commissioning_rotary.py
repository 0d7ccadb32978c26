"""Random axes that a motor turns for `make_commissioning`."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import commissioning
import commissioning_axis
import numpy as np

from macromicro.commission import axis, rotary
from macromicro.commission.running import Commissioned
from macromicro.machines import sheets


def figures(random: np.random.Generator) -> dict[str, Any]:
    """Data-sheet figures over wide ranges: direct drives, and gears of 3 to 100."""
    between = partial(commissioning.between, random)
    direct = bool(random.random() < 0.3)
    ratio = 1.0 if direct else between(3.0, 100.0)
    constant = between(0.02, 0.3) if direct else between(0.005, 0.08)
    supply = float(random.choice([12.0, 24.0, 48.0]))
    resistance = between(0.5, 12.0)
    current = supply / resistance * between(0.3, 1.5)
    rotor = between(2e-7, 2e-5) * (5.0 if direct else 1.0)
    most = constant * ratio * min(current, supply / resistance)
    coulomb = most * between(0.02, 0.2)
    period = float(random.choice([0.25e-3, 0.5e-3, 1e-3]))
    at = "load" if direct else str(random.choice(["motor", "load"]))
    turns = ratio if at == "motor" else 1.0
    return {
        "amplifier.mode": "voltage",
        "amplifier.supply": f"{supply!r} V",
        "amplifier.current": f"{current!r} A",
        "motor.constant": f"{constant!r} N*m/A",
        "motor.resistance": f"{resistance!r} ohm",
        "motor.inductance": f"{resistance * between(0.05e-3, 0.8e-3)!r} H",
        "motor.inertia": f"{rotor!r} kg*m^2",
        "drive.ratio": ratio,
        "load.inertia": f"{rotor * ratio * ratio * between(0.3, 10.0)!r} kg*m^2",
        "load.stop_low": f"{-between(2.0, 30.0)!r} deg",
        "load.stop_high": f"{between(60.0, 350.0)!r} deg",
        "load.stop_stiffness": f"{between(20.0, 200.0) * most!r} N*m/rad",
        "load.stop_damping": f"{0.02 * most!r} N*m*s/rad",
        "friction.coulomb": f"{coulomb!r} N*m",
        "friction.stribeck": f"{coulomb * between(0.02, 0.4)!r} N*m",
        "friction.stribeck_speed": f"{between(0.3, 10.0)!r} deg/s",
        "friction.viscous": f"{most * between(0.0005, 0.01)!r} N*m*s/rad",
        "friction.presliding": f"{between(1.0, 10.0)!r} mdeg",
        "friction.ripple": f"{coulomb * between(0.005, 0.08)!r} N*m",
        "friction.ripple_long": f"{between(40.0, 120.0)!r} deg",
        "friction.ripple_short": f"{between(10.0, 30.0)!r} deg",
        "encoder.at": at,
        "encoder.counts": float(round(between(20_000.0, 400_000.0) / turns)),
        "encoder.rate": "1e8 counts/s",
        "timing.period": f"{period!r} s",
        "timing.delay": f"{random.uniform(0.05, 1.0) * period!r} s",
    }


def eccentric(random: np.random.Generator) -> dict[str, Any]:
    """The same with a load that hangs anywhere: 2 to 35 % of the motor's torque."""
    made = figures(random)

    def number(path: str) -> float:
        return float(str(made[path]).split()[0])

    current = min(
        number("amplifier.current"), number("amplifier.supply") / number("motor.resistance")
    )
    most = number("motor.constant") * number("drive.ratio") * current
    part = commissioning.between(random, 0.02, 0.35)
    return {
        **made,
        "load.unbalance": f"{part * most!r} N*m",
        "load.hangs": f"{random.uniform(-180.0, 180.0)!r} deg",
    }


def hung(tree: Any, found: Commissioned) -> dict[str, float]:
    """As that of an axis, with gravity; where it hangs from the low end that was found."""
    most, hangs = sheets.eccentric_load(tree)
    return {
        **commissioning_axis.truth(tree, found),
        "unbalance": sheets.per_newton(tree) * most,
        "hangs": math.remainder(hangs - axis.ends_of(found.work).low, 2.0 * math.pi),
    }


DRAWN = commissioning.of_figures(rotary.KIND, figures, commissioning_axis.truth, 100, 2032)
ECCENTRIC = commissioning.of_figures(rotary.KIND, eccentric, hung, 40, 2040)
