"""Robustness of an axis' gains: margins on the identified model and on drawn models."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import margins
from macromicro.commission._axis_fit import Model
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.procedure import Robustness
from macromicro.machines import loops, sheets
from macromicro.machines.loops import Complex
from macromicro.machines.rotary import as_axis

_SLOWEST = 1e-3  # of the velocity loop's bandwidth: far below all poles but those at 0
_EVERY = 2  # of the frequencies that a loop is looked at
_POLES = 2  # of the open loop at 0


def drawn(settings: Any, model: Model, number: int, seed: int = SEED) -> Iterator[Any]:
    """Machines within the uncertainty of the linear loop."""
    random, mode = np.random.Generator(np.random.PCG64(seed)), model.limber
    off = dict.fromkeys(("resonance", "damping", "lag"), 0.0) | (
        {} if mode is None else mode.errors
    )
    mean = np.array([getattr(model.axis, name) for name in model.names])
    for row in random.multivariate_normal(mean, model.covariance, number, method="svd"):
        values = dict(zip(model.names, row, strict=True))
        heavier = max(values["mass"] / model.axis.mass, 0.01)
        rubs = values["viscous"] - model.axis.viscous
        late = values.get("lag", model.axis.lag) - model.axis.lag
        resonance, damping, lag = (one * random.standard_normal() for one in off.values())
        load, motor, drive = settings.load, settings.motor, settings.drive
        stiffer = 1.0 if mode is None else 1.0 + resonance / mode.shape.resonance
        yield settings._replace(
            load=load._replace(mass=heavier * load.mass, payload=heavier * load.payload),
            motor=motor._replace(inertia=heavier * motor.inertia),
            drive=drive._replace(
                inertia=heavier * drive.inertia,
                frequency=max(stiffer, 0.1) * drive.frequency,
                damping=max(drive.damping + damping, 0.0),
            ),
            friction=settings.friction._replace(viscous=settings.friction.viscous + rubs),
            timing=settings.timing._replace(delay=max(settings.timing.delay + late + lag, 0.0)),
        )


def robust(settings: Any, model: Model, number: int = DRAWS) -> Robust:
    made = as_axis(settings)
    frequency, law = _looked(made, model)
    every = (sheets.plant(one, frequency) * law for one in drawn(made, model, number))
    return margins.robust(frequency, sheets.plant(made, frequency) * law, every, poles=_POLES)


def keeps(settings: Any, model: Model, each: Iterable[Any], modulus: float) -> bool:
    """Whether the loop is stable on all machines with at least the given modulus margin."""
    frequency, law = _looked(settings, model)
    loop = (sheets.plant(one, frequency) * law for one in each)
    return all(loops.modulus(one, _POLES) >= modulus for one in loop)


def _looked(made: Any, model: Model) -> tuple[Array, Complex]:
    """Frequencies from far below the bandwidth, and the law's response."""
    dt, bandwidth = made.timing.period, made.controller.velocity / model.axis.mass
    frequency = loops.grid(dt, _SLOWEST * bandwidth)[::-_EVERY][::-1]
    return frequency, loops.law(made.controller, frequency, dt)


def told(settings: Any, model: Model) -> Robustness:
    return margins.told(robust(settings, model), "strokes over a longer travel")
