"""The correction of a stage, from its settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from macromicro.control import correction
from macromicro.control.correction import Load, Tables
from macromicro.machines import sheets
from macromicro.machines.tree import gains, is_corrected


def load(tree: Any) -> Load:
    """What decides on which flank of its drive a stage's load lies."""
    most = tree.motion
    pitch = float(tree.encoder.pitch)
    if not hasattr(tree, "drive") or not hasattr(tree, "friction"):
        return Load(most.velocity, most.acceleration, pitch=pitch)
    moved = tree.load.mass + tree.load.payload
    coast, weight = tree.friction.coulomb / moved, sheets.weight(tree) / moved
    frequency = tree.drive.frequency or math.inf
    friction = float(getattr(gains(tree), "ahead_friction", 0.0))
    return Load(most.velocity, most.acceleration, coast, weight, frequency, pitch, friction)


USUAL = 12e-6  # 1/K; growth of steel, of a stage whose own was not measured


def half_width(tree: Any, degrees: float, place: float, t: float) -> float:
    """Half width that the calibration of a stage promises at a place; 0 without one.

    Outside the temperatures of the calibration, or longer after the start than it was measured, it
    grows with what the stage may have grown.
    """
    if not is_corrected(tree) or not tree.correction.on:
        return 0.0
    p = tree.correction
    grown = max(abs(p.expansion), USUAL) * beyond(tree, degrees)
    if t > p.warm_until:
        grown += abs(p.warm_up) * (
            math.exp(-p.warm_until / p.warm_time) - math.exp(-t / p.warm_time)
        )
    return float(p.half_width + grown * abs(place - p.fixed))


def beyond(tree: Any, degrees: float) -> float:
    """How far a temperature is outside those of a stage's calibration, K."""
    if not is_corrected(tree) or math.isnan(degrees):
        return 0.0
    return float(max(tree.correction.cold - degrees, degrees - tree.correction.hot, 0.0))


def tables(tree: Any, names: Sequence[str] = ()) -> Tables:
    """The correction of a stage for the kernels; `names` are those of all stages."""
    return correction.tables(tree.correction, load(tree), names)
