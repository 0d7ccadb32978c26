"""How far programmes may go: the travel of both stages, short of what stops them."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.programme.moves import Limits
from macromicro.schema.par import Par


class Travel(NamedTuple):
    """Targets of programmes lie from 0 to these."""

    macro: Annotated[
        float,
        Par("m", "farthest macro target", "Section 3.1 (M16)", shown="mm", positive=True),
    ] = nominal.TRAVEL
    micro: Annotated[
        float, Par("m", "farthest micro target", "machine choice", shown="mm", positive=True)
    ] = nominal.FINE_TRAVEL


def limits(travel: Travel, pitch: float) -> Limits:
    """Limits of a programme.

    Parameters
    ----------
    travel : Travel
        How far programmes may go.
    pitch : float
        Travel per encoder count, m.

    Returns
    -------
    Limits
        In counts and m.
    """
    most = int(travel.macro / pitch + 1e-6)
    return Limits(0.0, float(most), 0.0, travel.micro, 1.0 / pitch)
