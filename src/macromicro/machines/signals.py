"""The signals of a single-stage control period; the recording's columns follow from them."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Quantity
from macromicro.control.stage_law import Sample, Target

__all__ = ["Inside", "Output", "Sample", "Target"]


class Output(NamedTuple):
    """What a stage is given.

    Examples
    --------
    >>> from macromicro.machines.signals import Output
    >>> Output(effort=1.5)  # V
    Output(effort=1.5)
    """

    effort: Annotated[float, Quantity("V", "effort at the D/A")]


class Inside(NamedTuple):
    """What sequence and guard know.

    Examples
    --------
    >>> from macromicro.machines.signals import Inside
    >>> Inside(phase=1.0, move=0.0, arrived=0.0).phase  # moving
    1.0
    """

    phase: Annotated[float, Quantity("1", "0 waiting 1 moving 2 holding 3 done 4 fault", "i1")]
    move: Annotated[float, Quantity("1", "index of the present move, -1 before the first", "i4")]
    arrived: Annotated[
        float, Quantity("1", "1 while the present move has arrived, 0 otherwise", "i1")
    ]
