"""The axis of `macromicro.models.mass`, under the name by which identification knows it."""

from macromicro.models.mass import (
    Axis,
    acting,
    breakaway,
    decay,
    free_run,
    given,
    late,
    level,
    motion,
    simulate,
    stopping,
)
from macromicro.models.mass import glide as step

__all__ = [
    "Axis", "acting", "breakaway", "decay", "free_run", "given", "late", "level", "motion",
    "simulate", "step", "stopping",
]  # fmt: skip
