"""Switches, index pulses and drive lines in the settings of an axis."""

from __future__ import annotations

import math
from typing import Any

from macromicro.machines import sheets
from macromicro.machines.parts import BOTH, HIGH, LOW, MARK, NONE, TURN
from macromicro.plant.power import LINE
from macromicro.types import ENABLE


def lines(tree: Any) -> tuple[str, ...]:
    switches, amplifier = tree.switches, tree.amplifier
    climate = getattr(tree, "climate", None)
    there = {
        "limit_low": switches.limits in (LOW, BOTH),
        "limit_high": switches.limits in (HIGH, BOTH),
        "home": switches.home != NONE,
        "index_count": tree.encoder.index_pulse != NONE,
        "drive_fault": amplifier.fault == LINE,
        "enabled": amplifier.enable == LINE,
        "temperature": climate is not None and climate.sensor == 1,
        ENABLE: amplifier.enable == LINE,
    }
    return tuple(name for name, has in there.items() if has)


def spacing(tree: Any) -> float:
    """Distance between index pulses."""
    if tree.encoder.index_pulse == MARK and sheets.endless(tree):
        return 2.0 * math.pi
    return sheets.turn(tree) if tree.encoder.index_pulse == TURN else 0.0
