"""The contract of a macro-stage control law: gains, memory, one step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Law(NamedTuple):
    """A law as `control.macro.LAWS` lists it. `start` and `step` are kernels.

    Examples
    --------
    >>> from macromicro.control import pd
    >>> from macromicro.control.law import Law
    >>> law = Law("pd-mine", pd.PdTuned, pd.start, pd.step)
    >>> law.field
    'pd_mine'
    >>> memory, effort = law.step(law.gains(), law.start(0.0), 100.0, 0.001)  # 100 counts, 1 ms
    >>> round(effort, 3)  # V
    1.246
    """

    name: str  #: as in the settings
    #: A ``NamedTuple`` with defaults, its fields annotated with `Par`; they become the set `field`
    #: of `controller` in the settings
    gains: Any
    #: from an error (counts) to what the law remembers before its first period, as if that error
    #: had been there before; a ``NamedTuple`` of floats, of any fields
    start: Callable[[float], Any]
    #: from gains, memory, error (counts) and period (s) to a new memory and an effort (V)
    step: Callable[[Any, Any, float, float], tuple[Any, float]]
    compensated: bool = True  #: whether the dead-zone inverse is on "as designed"

    @property
    def field(self) -> str:
        """Name of its gains among the settings."""
        return self.name.replace("-", "_")
