"""The correction of a stage, from its settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from macromicro.control import correction
from macromicro.control.correction import Load, Tables
from macromicro.machines import sheets
from macromicro.machines.tree import gains


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


def tables(tree: Any, names: Sequence[str] = ()) -> Tables:
    """The correction of a stage for the kernels; `names` are those of all stages."""
    return correction.tables(tree.correction, load(tree), names)
