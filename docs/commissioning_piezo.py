"""Random piezo stages for `make_commissioning`."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import commissioning
import numpy as np

from macromicro.commission import piezo
from macromicro.commission.piezo_drives import REACH
from macromicro.commission.running import Commissioned
from macromicro.hysteresis import prandtl_loop
from macromicro.plant import piezo as plant


def figures(random: np.random.Generator) -> dict[str, Any]:
    """Data-sheet figures, and what none prints."""
    between = partial(commissioning.between, random)
    stroke = between(15e-6, 900e-6)
    resonance = between(60.0, 900.0)
    low = float(random.choice([0.0, -20.0, -30.0]))
    high = float(random.choice([100.0, 120.0, 150.0]))
    period = min(0.1 / resonance * between(0.2, 0.7), 5e-4)
    capacitance = between(0.5e-6, 20e-6)
    # So that the stroke takes 0.5 to 5 periods of the resonance.
    current = capacitance * (high - low) * resonance / between(0.5, 5.0)
    return {
        "amplifier.low": f"{low!r} V",
        "amplifier.high": f"{high!r} V",
        "amplifier.bandwidth": f"{resonance * between(4.0, 15.0)!r} Hz",
        "amplifier.capacitance": f"{capacitance!r} F",
        "amplifier.current": f"{current!r} A",
        "stack.stroke": f"{stroke!r} m",
        "stack.span": f"{high - low!r} V",
        "stack.hysteresis": between(0.08, 0.16),
        "creep.share": between(0.008, 0.025),
        "creep.first": f"{between(0.05, 0.2)!r} s",
        "creep.decades": int(random.integers(3, 6)),
        "guide.resonance": f"{resonance!r} Hz",
        "guide.load": "0 kg",
        "hidden.stronger": between(0.85, 1.15),
        "hidden.detuned": between(0.85, 1.15),
        "hidden.damping": between(0.008, 0.06),
        "hidden.spread": between(0.1, 0.3),
        "hidden.plays": int(random.integers(16, 48)),
        "hidden.widening": f"{between(0.03e-3, 0.3e-3)!r} s",
        "warming.change": f"{random.uniform(-1.0, 1.0)!r} K",
        "encoder.noise": f"{stroke * between(1e-6, 2e-5)!r} m",
        "encoder.pitch": f"{stroke * between(5e-7, 1e-5)!r} m",
        "encoder.low": f"{-0.3 * stroke!r} m",
        "encoder.high": f"{1.4 * stroke!r} m",
        "timing.period": f"{period!r} s",
        "timing.delay": f"{random.uniform(0.05, 0.9) * period!r} s",
        "travel.high": f"{0.5 * stroke!r} m",
    }


def truth(tree: Any, found: Commissioned) -> dict[str, float]:
    """What the estimates are, by the stage's figures; volts at the D/A."""
    ready, gain = plant.prepare(tree), tree.amplifier.gain
    extent = gain * found.work[REACH].extent
    p = ready.hysteresis
    loop = prandtl_loop.measured(p.thresholds, p.weights, extent)
    return {
        "stroke": loop.stroke,
        "hysteresis": loop.width / loop.stroke,
        "creep": tree.creep.share,
        "resonance": ready.omega / (2.0 * math.pi),
        "damping": ready.damping,
        "lag": tree.timing.delay + 1.0 / (2.0 * math.pi * tree.amplifier.bandwidth),
        "slew": tree.amplifier.current / tree.amplifier.capacitance / gain,
    }


DRAWN = commissioning.of_figures(piezo.KIND, figures, truth, 100, 2028)
