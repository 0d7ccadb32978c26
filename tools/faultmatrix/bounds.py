"""What a machine is judged by, from its settings."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.serve.settings import StageSettings
from macromicro.serve.stage import guide


class Bounds(NamedTuple):
    """`resolution` [m]; `fastest` [m/s]; `push` [V] of each output; `still` [m]: less is no motion;
    `repeat` [m]: how well homing finds the same place; `arrival` [m]: what counts as arrived;
    `effort` [V]: the greatest."""

    resolution: float
    fastest: float
    push: tuple[float, ...]
    still: float
    repeat: float = 0.0
    arrival: float = 0.0
    effort: float = 5.0


def leading(settings: Any) -> tuple[Any, Any] | None:
    """Machine and settings of the stage whose faults are tried, of two axes the first; None for the
    two-stage machine."""
    if not isinstance(settings, StageSettings):
        return None
    return settings.machine.stages[0][1], settings.trees[0][1]


def bounds(settings: Any) -> Bounds:
    """Those of a machine."""
    found = leading(settings)
    if found is None:  # its law has no speed, its guard judges what it pushes without motion
        pitch = settings.live.pitch  # twice: homing, too, has read a whole count
        return Bounds(2.0 * pitch, 1.0, (4.75, 4.75), 5e-4, 2.0 * pitch, 5e-5)
    machine, tree = found
    guard, span, resolution = tree.guard, tree.travel.high - tree.travel.low, guide.count(tree)
    touch = guide.guide(machine, tree).touch
    repeat = 0.0 if touch is None else touch.give
    if touch is not None and touch.seek is not None:  # a switch, looked at once in a period
        repeat = 4.0 * tree.switches.repeatability + 2.0 * settings.period * touch.slow
    push = (min(guard.push, 0.95 * guard.effort), math.inf)
    fastest = max(tree.motion.velocity, guard.speed / 1.5)
    still = max(5 * resolution, 1e-3 * span)
    return Bounds(resolution, fastest, push, still, repeat, tree.arrival.tolerance, guard.effort)
