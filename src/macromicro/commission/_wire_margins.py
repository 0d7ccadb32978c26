"""Robustness of a wire's gains: margins at the steepest point as identified and on drawn wires."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import margins
from macromicro.commission._wire_fit import MODEL_ERRORS, Wire
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.procedure import Robustness
from macromicro.commission.wire_model import Heat, steepest
from macromicro.control.stage_pi import StagePi
from macromicro.machines import loops
from macromicro.machines.loops import Complex

_SLOWEST = 1e-3  # of the slowest pole but that at 0
_LEAST = 0.05  # of a parameter: no draw is below it


def plant(p: Heat, settings: Any, frequency: Array) -> Complex:
    """Response along the steepest branch at its steepest point, with driver lag, hold and delay."""
    s = np.asarray(2j * math.pi * np.asarray(frequency), np.complex128)
    slope, behind = steepest(p), p.share / (1.0 - p.share)
    around = behind / (p.slow * s + 1.0 + behind)
    heat = (1.0 - p.share) / ((p.tau + p.latent * slope) * s + 1.0 - around)
    given = loops.stepped(s, settings.timing) / (1.0 + settings.driver.lag * s)
    found: Complex = p.way * slope * heat * given
    return found


def law(p: StagePi, frequency: Array, dt: float) -> Complex:
    """Effort per position error, without limits."""
    z = np.exp(2j * math.pi * np.asarray(frequency) * dt)
    found: Complex = p.kp + p.ki * dt / (z - 1.0)
    return found


def drawn(found: Wire, number: int, seed: int = SEED) -> Iterator[tuple[Heat, float]]:
    random = np.random.Generator(np.random.PCG64(seed))
    values = np.array(found.heat)
    for row in random.multivariate_normal(values, found.spread.covariance, number, method="svd"):
        p = Heat(*np.where(values > 0.0, np.maximum(row, _LEAST * values), row).tolist())
        p = p._replace(share=min(p.share, 1.0 - _LEAST))
        up, down = found.heat.end - found.heat.start, found.heat.first - found.heat.last
        p = p._replace(
            end=max(p.end, p.start + _LEAST * up), first=max(p.first, p.last + _LEAST * down)
        )
        yield p, 1.0 + MODEL_ERRORS["up"] * random.standard_normal()


def robust(settings: Any, found: Wire) -> Robust:
    p, dt = settings.controller, settings.timing.period
    heat = found.heat
    slowest = min(1.0 / (heat.slow + heat.tau), p.ki / p.kp) / (2.0 * math.pi)
    frequency = loops.grid(dt, _SLOWEST * slowest)
    control = law(p, frequency, dt)
    every = (more * control * plant(one, settings, frequency) for one, more in drawn(found, DRAWS))
    whole = control * plant(heat, settings, frequency)
    return margins.robust(frequency, whole, every, poles=1)


def told(settings: Any, found: Wire) -> Robustness:
    return margins.told(robust(settings, found), "a sensor with less noise")
