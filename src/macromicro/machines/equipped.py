"""An axis with its switches, index pulses and drive lines."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

from macromicro.arrays import Array
from macromicro.kernel import kernel
from macromicro.machines import axis
from macromicro.machines._wiring import lines, spacing
from macromicro.machines.parts import CAM
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.plant import axis as plant
from macromicro.plant import drive_lines, equipped
from macromicro.plant.drive_lines import Wiring
from macromicro.plant.switches import Index, Switch
from macromicro.types import ENABLE


def kind(tree: Any) -> Kind:
    there = lines(tree)
    return _kind(there) if there else axis.KIND


@lru_cache(maxsize=16)
def _kind(there: tuple[str, ...]) -> Kind:
    return Kind(
        axis.NAME,
        equipped.NOISES,
        plant.Truth,
        prepare,
        equipped.at_rest,
        measure,
        equipped.advance,
        equipped.truth,
        there,
        equipped.lines,
        equipped.asked,
    )


def prepare(tree: Any) -> equipped.Equipped:
    there, s, amplifier = lines(tree), tree.switches, tree.amplifier
    scatter, width = (s.hysteresis, s.repeatability), math.inf
    cam = s.home_width if s.home == CAM else math.inf
    current, continuous = amplifier.current, amplifier.continuous
    return equipped.Equipped(
        axis.prepare(tree),
        Switch(int("limit_low" in there), 1.0, s.low, width, *scatter),
        Switch(int("limit_high" in there), -1.0, s.high, width, *scatter),
        Switch(int("home" in there), 1.0, s.home_place, cam, *scatter),
        Index(int("index_count" in there), tree.encoder.index_place, spacing(tree)),
        Wiring(
            int(ENABLE in there),
            amplifier.enable_time,
            int("drive_fault" in there),
            continuous,
            drive_lines.slow(current, continuous, amplifier.peak_time),
        ),
    )


@kernel
def measure(p: equipped.Equipped, s: equipped.State, t: float, noise: Array, k: int) -> Sample:
    return Sample(t, equipped.measured(p, s, noise, k) * p.axis.reading.encoder.pitch)
