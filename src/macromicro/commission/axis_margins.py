"""How robust the gains of an axis are: its loop on the model that was found, and on models drawn
from what the model is uncertain by."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import margins
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.model import Model
from macromicro.commission.procedure import Robustness
from macromicro.machines import loops, sheets
from macromicro.machines.loops import Complex
from macromicro.machines.rotary import as_axis

_SLOWEST = 1e-3  # of the velocity loop's bandwidth: far below all poles but those at 0
_EVERY = 2  # of the frequencies that a loop is looked at
_POLES = 2  # of the open loop at 0


def drawn(settings: Any, model: Model, number: int, seed: int = SEED) -> Iterator[Any]:
    """Machines that the measurements leave possible, as far as the linear loop goes.

    Parameters
    ----------
    settings : Any
        Of the machine that was found, as of an axis.
    model : Model
        Of strokes and chirp.
    number : int
        How many.
    seed : int, optional
        Of the draws.

    Yields
    ------
    Any
        Settings with another mass, viscous slope, lag and mode: normal draws, from the covariance
        of the strokes and the standard errors of the chirp.
    """
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
    """Margins under the gains that were found.

    Parameters
    ----------
    settings : Any
        Of the machine that was found, of the law `cascade`.
    model : Model
        Of strokes and chirp.
    number : int, optional
        How many models are drawn.

    Returns
    -------
    Robust
        On the model, and on what it may be as well.
    """
    made = as_axis(settings)
    frequency, law = _looked(made, model)
    every = (sheets.plant(one, frequency) * law for one in drawn(made, model, number))
    return margins.robust(frequency, sheets.plant(made, frequency) * law, every, poles=_POLES)


def keeps(settings: Any, model: Model, each: Iterable[Any], modulus: float) -> bool:
    """Whether the loop is stable on all of some machines, and comes no nearer to -1 on any.

    Parameters
    ----------
    settings : Any
        Of an axis, of the law `cascade`, whose gains count.
    model : Model
        Of strokes and chirp.
    each : Iterable[Any]
        Settings of the machines, as from `drawn`; their gains do not count.
    modulus : float
        The least distance from -1 that will do, above 0.

    Returns
    -------
    bool
        The first machine that it fails on ends it.
    """
    frequency, law = _looked(settings, model)
    loop = (sheets.plant(one, frequency) * law for one in each)
    return all(loops.modulus(one, _POLES) >= modulus for one in loop)


def _looked(made: Any, model: Model) -> tuple[Array, Complex]:
    """The frequencies at which a loop is looked at, from far below its bandwidth, and its law."""
    dt, bandwidth = made.timing.period, made.controller.velocity / model.axis.mass
    frequency = loops.grid(dt, _SLOWEST * bandwidth)[::-_EVERY][::-1]
    return frequency, loops.law(made.controller, frequency, dt)


def told(settings: Any, model: Model) -> Robustness:
    """What `robust` says, in words.

    Parameters
    ----------
    settings : Any
        Of the machine that was found.
    model : Model
        Of strokes and chirp.

    Returns
    -------
    Robustness
        Margins, and whether what is not known may spoil the loop.
    """
    return margins.told(robust(settings, model), "strokes over a longer way")
