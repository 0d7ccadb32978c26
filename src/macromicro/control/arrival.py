"""When a macro move has arrived, for programmes and live moves."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple, Protocol

from macromicro.kernel import kernel
from macromicro.schema.par import Par

TICK = 1e-9  # s; slack of comparisons of times
FARTHEST = 1e6  # counts of any encoder; `rules` limits them by the travel
LONGEST = 600.0  # s; the whole travel at 0.3 mm/s


class Sequence(NamedTuple):
    """When a macro move counts as arrived, and what follows."""

    tolerance: Annotated[
        float,
        Par("count", "macro error that counts as arrived", "Section 4.3", lo=0.0, hi=FARTHEST),
    ] = 2.0
    dwell: Annotated[
        float, Par("s", "time within the tolerance before arrival is declared", lo=0.0, hi=60.0)
    ] = 0.2
    patience: Annotated[
        float,
        Par(
            "s",
            "longest wait for an arrival; the move is then reported as not arrived",
            lo=0.1,
            hi=LONGEST,
        ),
    ] = 15.0
    wait: Annotated[
        float,
        Par("s", "wait between arrival and the micro-stage", "Section 6.1", lo=0.0, hi=LONGEST),
    ] = 2.0
    park: Annotated[
        int,
        Par(
            "",
            "1: motor off once arrived, so that a flickering count does not kick the "
            "carriage under the micro-stage; 0: macro control stays on",
            lo=0,
            hi=1,
        ),
    ] = 1
    overlap: Annotated[
        int,
        Par(
            "",
            "1: with a macro move the micro-stage goes to its next place, or stays where it is; "
            "0: it is extended until the wait is over",
            lo=0,
            hi=1,
        ),
    ] = 0


class Rule(Protocol):
    """An arrival rule: `Sequence`, or that of another machine."""

    @property
    def tolerance(self) -> float: ...

    @property
    def dwell(self) -> float: ...


@kernel
def within(p: Rule, error: float) -> bool:
    """Whether an error is within the tolerance; NaN is not."""
    return abs(error) <= p.tolerance


@kernel
def since(p: Rule, error: float, before: float, t: float) -> float:
    """Since when the error is within the tolerance."""
    if not within(p, error):
        return math.nan
    return t if math.isnan(before) else before


@kernel
def arrived(p: Rule, inside: float, t: float) -> bool:
    return t - inside >= p.dwell - TICK
