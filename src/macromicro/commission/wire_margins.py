"""How robust the gains of a wire are: its loop where heat moves it most, as it was found and on
wires drawn from what ramp and pulses leave uncertain."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import margins
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.procedure import Robustness
from macromicro.commission.wire_fit import LEFT_OUT, Wire
from macromicro.commission.wire_model import Heat, steepest
from macromicro.control.pi import PiAntiWindup
from macromicro.machines import loops
from macromicro.machines.loops import Complex

_SLOWEST = 1e-3  # of the slowest pole but that at 0
_LEAST = 0.05  # of a parameter: no draw is below it


def plant(p: Heat, settings: Any, frequency: Array) -> Complex:
    """Contraction per effort along the branch that is steepest, where it is steepest.

    Between its branches, after a turn, a wire answers less. With the driver's lag, the hold over a
    period and the delay.

    Parameters
    ----------
    p : Heat
        Of the wire.
    settings : Any
        Of the machine: its driver and timing.
    frequency : ndarray, shape (n,)
        Hz.

    Returns
    -------
    ndarray of complex, shape (n,)
        m/V.
    """
    s = np.asarray(2j * math.pi * np.asarray(frequency), np.complex128)
    slope, behind = steepest(p), p.share / (1.0 - p.share)
    around = behind / (p.slow * s + 1.0 + behind)
    heat = (1.0 - p.share) / ((p.tau + p.latent * slope) * s + 1.0 - around)
    given = loops.stepped(s, settings.timing) / (1.0 + settings.driver.lag * s)
    found: Complex = p.way * slope * heat * given
    return found


def law(p: PiAntiWindup, frequency: Array, dt: float) -> Complex:
    """Effort per position error, without limits.

    Parameters
    ----------
    p : PiAntiWindup
        Gains.
    frequency : ndarray, shape (n,)
        Hz.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray of complex, shape (n,)
        V/m.
    """
    z = np.exp(2j * math.pi * np.asarray(frequency) * dt)
    found: Complex = p.kp + p.ki * dt / (z - 1.0)
    return found


def drawn(found: Wire, number: int, seed: int = SEED) -> Iterator[tuple[Heat, float]]:
    """The wire as it may be as well.

    Parameters
    ----------
    found : Wire
        Of ramp and pulses.
    number : int
        How many.
    seed : int, optional
        Of the draws.

    Yields
    ------
    Heat
        Its parameters, from their covariance.
    float
        By how much more it answers: what the model leaves out of the speed of contraction.
    """
    random = np.random.Generator(np.random.PCG64(seed))
    values = np.array(found.heat)
    for row in random.multivariate_normal(values, found.covariance, number, method="svd"):
        p = Heat(*np.where(values > 0.0, np.maximum(row, _LEAST * values), row).tolist())
        p = p._replace(share=min(p.share, 1.0 - _LEAST))
        up, down = found.heat.end - found.heat.start, found.heat.first - found.heat.last
        p = p._replace(
            end=max(p.end, p.start + _LEAST * up), first=max(p.first, p.last + _LEAST * down)
        )
        yield p, 1.0 + LEFT_OUT["up"] * random.standard_normal()


def robust(settings: Any, found: Wire) -> Robust:
    """Margins under the gains that were found.

    Parameters
    ----------
    settings : Any
        Of the machine that was found, of the law `pi`.
    found : Wire
        Of ramp and pulses.

    Returns
    -------
    Robust
        On the model, and on what it may be as well.
    """
    p, dt = settings.controller, settings.timing.period
    heat = found.heat
    slowest = min(1.0 / (heat.slow + heat.tau), p.ki / p.kp) / (2.0 * math.pi)
    frequency = loops.grid(dt, _SLOWEST * slowest)
    control = law(p, frequency, dt)
    every = (more * control * plant(one, settings, frequency) for one, more in drawn(found, DRAWS))
    whole = control * plant(heat, settings, frequency)
    return margins.robust(frequency, whole, every, poles=1)


def told(settings: Any, found: Wire) -> Robustness:
    """What `robust` says, in words.

    Parameters
    ----------
    settings : Any
        Of the machine that was found.
    found : Wire
        Of ramp and pulses.

    Returns
    -------
    Robustness
        Margins, and whether what is not known may spoil the loop.
    """
    return margins.told(robust(settings, found), "a sensor of less noise")
