from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.schema.par import Par


class Steps(NamedTuple):
    """Steps per control period (1 ms); doubling them must change nothing a user sees."""

    macro: Annotated[
        int, Par("", "physics steps per control period, macro-stage", lo=1, hi=1000)
    ] = 20
    micro: Annotated[
        int, Par("", "physics steps per control period, micro-stage", lo=1, hi=100)
    ] = 1
