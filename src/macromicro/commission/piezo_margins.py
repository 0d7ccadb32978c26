"""How robust the gains of a piezo stage are: its loop as it was found, and on stages drawn from
what swings and steps leave uncertain."""

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
    """The stage as it may be as well: another stroke than the one inverted, and another resonance.

    Parameters
    ----------
    settings : Any
        Of the machine that was found.
    model : Model
        Of swings and steps.
    frequency : ndarray, shape (n,)
        Hz.
    number : int
        How many.
    seed : int, optional
        Of the draws.

    Yields
    ------
    ndarray of complex, shape (n,)
        Position per correction, m/m: stroke, resonance, damping and lag by normal draws.
    """
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
    """Margins under the gains that were found.

    Parameters
    ----------
    settings : Any
        Of the machine that was found, of the law `integral`.
    model : Model
        Of swings and steps.

    Returns
    -------
    Robust
        On the model, and on what it may be as well.
    """
    p, dt = settings.controller, settings.timing.period
    poles = 2 if p.drift > 0.0 else 1
    frequency = loops.grid(dt, _SLOWEST * (p.drift if poles == 2 else p.integral))
    law = piezo_loop.law(p, frequency, dt)
    every = (law * one for one in drawn(settings, model, frequency, DRAWS))
    found = law * piezo_loop.plant(settings, frequency)
    return margins.robust(frequency, found, every, poles)


def told(settings: Any, model: Model) -> Robustness:
    """What `robust` says, in words.

    Parameters
    ----------
    settings : Any
        Of the machine that was found.
    model : Model
        Of swings and steps.

    Returns
    -------
    Robustness
        Margins, and whether what is not known may spoil the loop.
    """
    return margins.told(robust(settings, model), "a sensor of less noise")
