"""The linear loop of a piezo stage."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.control.integral import Integral
from macromicro.machines.loops import Complex, hold_and_delay, notch_response
from macromicro.machines.piezo_sheets import omega


def law(p: Integral, frequency: Array, dt: float) -> Complex:
    """Correction per position error, without limits."""
    z = np.exp(2j * math.pi * np.asarray(frequency) * dt)
    summed = dt / (1.0 - 1.0 / z)
    found: Complex = p.proportional + p.integral * summed * (1.0 + p.drift * summed)
    return found * notch_response(p.notch, frequency, dt)


def plant(tree: Any, frequency: Array) -> Complex:
    """Position per correction: amplifier, resonance, hold and delay; hysteresis is inverted."""
    hidden = tree.hidden
    s = np.asarray(2j * math.pi * np.asarray(frequency), np.complex128)
    w = hidden.detuned * omega(tree)
    swung = w * w / (s * s + 2.0 * hidden.damping * w * s + w * w)
    given = 1.0 / (1.0 + s / (2.0 * math.pi * tree.amplifier.bandwidth))
    found: Complex = given * swung * hold_and_delay(s, tree.timing)
    return found
