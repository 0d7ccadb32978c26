"""How robust the gains of an axis are: margins of its loop on the model that was found, and the
least of them on models drawn from what the model is uncertain by. No machine is looked at."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.commission.model import Model
from macromicro.commission.procedure import Robustness
from macromicro.machines import loops, sheets
from macromicro.machines.loops import Margins
from macromicro.machines.rotary import as_axis

DRAWS = 200
NEAR = 0.4  # of -1: a loop that comes nearer on a drawn model is doubtful
_SLOWEST = 1e-3  # of the velocity loop's bandwidth: far below all poles but those at 0
_SEED, _EVERY = 1, 2  # of the frequencies that a loop is looked at


class Robust(NamedTuple):
    """Margins of a loop.

    Attributes
    ----------
    found : Margins
        On the model that was found.
    least : Margins
        The least of each on `DRAWS` models drawn from its covariance; `crossover` as well.
    stable : int
        On how many of them the closed loop is stable.
    """

    found: Margins
    least: Margins
    stable: int


def drawn(settings: Any, model: Model, number: int, seed: int = _SEED) -> Iterator[Any]:
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


def robust(settings: Any, model: Model) -> Robust:
    """Margins under the gains that were found.

    Parameters
    ----------
    settings : Any
        Of the machine that was found, of the law `cascade`.
    model : Model
        Of strokes and chirp.

    Returns
    -------
    Robust
        On the model, and on what it may be as well.
    """
    made, dt = as_axis(settings), settings.timing.period
    bandwidth = made.controller.velocity / model.axis.mass
    frequency = loops.grid(dt, _SLOWEST * bandwidth)[::-_EVERY][::-1]
    law = loops.law(made.controller, frequency, dt)

    def looked(one: Any) -> tuple[Margins, bool]:
        loop = sheets.plant(one, frequency) * law
        return loops.margins(frequency, loop), loops.modulus(loop) > 0.0

    every = [looked(one) for one in drawn(made, model, DRAWS)]
    least = Margins(*(_least(column) for column in zip(*(m for m, _ in every), strict=True)))
    return Robust(looked(made)[0], least, sum(stable for _, stable in every))


def _least(values: Sequence[float]) -> float:
    return min((v for v in values if not math.isnan(v)), default=math.nan)


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
    found = robust(settings, model)
    of = (
        ("loop's crossover", found.found.crossover, found.least.crossover, "Hz"),
        ("phase margin", found.found.phase, found.least.phase, "deg"),
        ("gain margin", found.found.gain, found.least.gain, ""),
        ("least distance of the loop from -1", found.found.modulus, found.least.modulus, ""),
    )
    rows = tuple((name, f"{v:.3g}", f">= {least:.3g}", unit) for name, v, least, unit in of)
    return Robustness(rows, tuple(_doubts(found)))


def _doubts(found: Robust) -> Iterator[str]:
    if found.stable < DRAWS:
        yield (
            f"On {DRAWS - found.stable} of {DRAWS} models within the uncertainty of what was "
            "found the loop is not stable: smaller gains, or strokes over a longer way."
        )
    elif found.least.modulus < NEAR:
        yield (
            f"On models within the uncertainty of what was found the loop comes as near as "
            f"{found.least.modulus:.2g} to -1: it may ring."
        )
