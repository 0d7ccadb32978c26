"""What a control law of the macro-stage is: gains, a memory of its own, and one step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Law(NamedTuple):
    """A law as `control.macro.LAWS` lists it.

    `gains`: a ``NamedTuple`` with defaults, its fields annotated with `Par`; they become the
    set `field` of `controller` in the settings. `start(error) -> memory`: what the law
    remembers before its first period, as if `error` [counts] had been there before; a
    ``NamedTuple`` of floats, of any fields. `step(gains, memory, error, dt) -> (memory,
    effort [V])`. Both are kernels. `compensated`: the dead-zone inverse is on "as designed".
    """

    name: str
    gains: Any
    start: Callable[[float], Any]
    step: Callable[[Any, Any, float, float], tuple[Any, float]]
    compensated: bool = True

    @property
    def field(self) -> str:
        """Name of its gains among the settings."""
        return self.name.replace("-", "_")
