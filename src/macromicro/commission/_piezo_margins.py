"""Robustness of a piezo stage's gains: margins as identified and on drawn stages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.commission import margins
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.procedure import Robustness
from macromicro.machines import loops, piezo_loop
from macromicro.machines.loops import Complex

if TYPE_CHECKING:
    from macromicro.arrays import Array
    from macromicro.commission.piezo import Model

_SLOWEST = 1e-3  # of the slower integral


def drawn(
    settings: Any, model: Model, frequency: Array, number: int, seed: int = SEED
) -> Iterator[Complex]:
    """Drawn stages with another stroke than the one inverted, and another resonance."""
    random = np.random.Generator(np.random.PCG64(seed))
    loop, swing = model.loops, model.swing
    wide = np.array([loop.spread[1] / loop.stroke, *np.divide(swing.spread[:3], swing[:3])])
    hidden, amplifier = settings.hidden, settings.amplifier
    for off in random.standard_normal((number, 4)) * wide:
        stroke, resonance, damping, lag = np.maximum(1.0 + off, 0.05).tolist()
        one = settings._replace(
            hidden=hidden._replace(
                detuned=resonance * hidden.detuned, damping=damping * hidden.damping
            ),
            amplifier=amplifier._replace(bandwidth=amplifier.bandwidth / lag),
        )
        yield stroke * piezo_loop.plant(one, frequency)


def robust(settings: Any, model: Model) -> Robust:
    p, dt = settings.controller, settings.timing.period
    poles = 2 if p.drift > 0.0 else 1
    frequency = loops.grid(dt, _SLOWEST * (p.drift if poles == 2 else p.integral))
    law = piezo_loop.law(p, frequency, dt)
    every = (law * one for one in drawn(settings, model, frequency, DRAWS))
    found = law * piezo_loop.plant(settings, frequency)
    return margins.robust(frequency, found, every, poles)


def told(settings: Any, model: Model) -> Robustness:
    return margins.told(robust(settings, model), "a sensor with less noise")
