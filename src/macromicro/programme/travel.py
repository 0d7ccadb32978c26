"""The travel of programmes: that of both stages, short of the stops."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.programme.moves import Limits
from macromicro.schema.par import Par


class Travel(NamedTuple):
    macro: Annotated[
        float,
        Par("m", "farthest macro target", "Section 3.1 (M16)", shown="mm", positive=True),
    ] = nominal.TRAVEL
    micro: Annotated[
        float, Par("m", "farthest micro target", "machine choice", shown="mm", positive=True)
    ] = nominal.FINE_TRAVEL


def limits(travel: Travel, pitch: float) -> Limits:
    most = int(travel.macro / pitch + 1e-6)
    return Limits(0.0, float(most), 0.0, travel.micro, 1.0 / pitch)
