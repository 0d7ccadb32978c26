"""What a control law of the macro-stage is: gains, a memory of its own, and one step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Law(NamedTuple):
    """A law as `control.macro.LAWS` lists it. `start` and `step` are kernels.

    Attributes
    ----------
    name : str
        As in the settings.
    gains : Any
        A ``NamedTuple`` with defaults, its fields annotated with `Par`; they become the set `field`
        of `controller` in the settings.
    start : Callable[[float], Any]
        From an error (counts) to what the law remembers before its first period, as if that error
        had been there before; a ``NamedTuple`` of floats, of any fields.
    step : Callable[[Any, Any, float, float], tuple[Any, float]]
        From gains, memory, error (counts) and period (s) to a new memory and an effort (V).
    compensated : bool
        Whether the dead-zone inverse is on "as designed".
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
