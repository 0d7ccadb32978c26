"""A period of a macro law from an error alone, as this package's laws see it."""

from __future__ import annotations

from macromicro.control import macro
from macromicro.control.macro import MacroLaw, Memory
from macromicro.control.stage_law import Sample, Target


def by_error(p: MacroLaw, s: Memory, error: float, dt: float) -> tuple[Memory, float]:
    """`macro.step`, the carriage at 0 counts."""
    return macro.step(p, s, Target(error, 0.0, 0.0), Sample(0.0, 0.0), dt)
