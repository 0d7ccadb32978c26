"""Choice of the magnet by its largest change of flux (Section 3.2.3, Table 3.1).

Field in gauss as in the data sheets (1 G = 1e-4 T).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from macromicro.design._checks import DATA, positive, sheet
from macromicro.errors import InputError, ProblemError

INCH = 0.0254  # m


class Magnet(NamedTuple):
    """A data sheet, straight between its readings.

    Examples
    --------
    >>> from macromicro.design import Magnet, largest_change
    >>> bar = Magnet("bar", distance=(2e-3, 8e-3), flux=(600.0, 300.0))  # m, G
    >>> round(largest_change(bar, travel=4e-3).flux)  # G
    200
    """

    name: str  #: name of the magnet
    distance: tuple[float, ...]  #: distance to the sensor, m, rising
    flux: tuple[float, ...]  #: G, one per distance


class Change(NamedTuple):
    """The largest change of flux over a travel."""

    name: str  #: name of the magnet
    flux: float  #: G
    start: float  #: distance where the travel begins, m


def largest_change(magnet: Magnet, travel: float) -> Change:
    """The largest change of flux over a travel, anywhere within the data sheet.

    Exact for linear interpolation: the difference of the flux at both ends of the travel is then
    piecewise linear, and largest where one end meets a reading.

    Parameters
    ----------
    magnet : Magnet
        Data sheet.
    travel : float
        Travel, m.

    Returns
    -------
    Change
        Its size and place.

    Raises
    ------
    InputError
        A travel longer than the sheet, or readings out of order.

    Examples
    --------
    >>> from macromicro.design import Magnet, largest_change
    >>> disc = Magnet("disc", distance=(2e-3, 4e-3, 8e-3), flux=(900.0, 400.0, 100.0))  # m, G
    >>> largest_change(disc, travel=4e-3)
    Change(name='disc', flux=650.0, start=0.002)
    """
    _check(magnet)
    positive("magnet, travel", travel, "m")
    first, last = magnet.distance[0], magnet.distance[-1] - travel
    if last < first:
        raise InputError(
            f"magnet {magnet.name}, travel",
            travel,
            f"at most {magnet.distance[-1] - first:g} m, which its readings cover",
        )
    starts = sorted({*magnet.distance, *(d - travel for d in magnet.distance)})
    found = [
        Change(magnet.name, abs(_flux(magnet, s + travel) - _flux(magnet, s)), s)
        for s in starts
        if first <= s <= last
    ]
    return max(found, key=lambda c: c.flux)


def ranking(magnets: Sequence[Magnet], travel: float) -> list[Change]:
    """All magnets by their largest change over a travel (Table 3.1).

    Parameters
    ----------
    magnets : Sequence[Magnet]
        Data sheets.
    travel : float
        Travel, m.

    Returns
    -------
    list[Change]
        The best first.

    Raises
    ------
    ProblemError
        No magnet.
    InputError
        As for `largest_change`.

    Examples
    --------
    >>> from macromicro.design import Magnet, ranking
    >>> disc = Magnet("disc", distance=(2e-3, 4e-3, 8e-3), flux=(900.0, 400.0, 100.0))  # m, G
    >>> bar = Magnet("bar", distance=(2e-3, 8e-3), flux=(600.0, 300.0))
    >>> [(each.name, round(each.flux)) for each in ranking([bar, disc], travel=4e-3)]
    [('disc', 650), ('bar', 200)]
    """
    if not magnets:
        raise ProblemError("magnets", "none given", "Give one magnet or more.")
    return sorted((largest_change(m, travel) for m in magnets), key=lambda c: -c.flux)


def _flux(magnet: Magnet, place: float) -> float:
    """Flux [G] at a distance [m], interpolated between the readings."""
    for (d0, d1), (f0, f1) in zip(pairwise(magnet.distance), pairwise(magnet.flux), strict=True):
        if place <= d1:
            return f0 + (place - d0) / (d1 - d0) * (f1 - f0)
    return magnet.flux[-1]


def _check(magnet: Magnet) -> None:
    sheet("magnet", magnet, Magnet)
    where = f"magnet {magnet.name}"
    if len(magnet.distance) != len(magnet.flux) or len(magnet.distance) < 2:
        found = f"distances and readings number {len(magnet.distance)} and {len(magnet.flux)}"
        raise ProblemError(where, found, "Give as many of each, two or more.")
    if not all(math.isfinite(v) for v in magnet.distance + magnet.flux):
        raise ProblemError(where, "a distance or reading is not a finite number")
    if any(b <= a for a, b in pairwise(magnet.distance)):
        raise InputError(f"{where}, distance", magnet.distance, "distances that increase")


TABLE_3_1 = tuple(
    Magnet(name, tuple(INCH * d for d, _ in readings), tuple(f for _, f in readings))
    for name, readings in DATA["magnets"].items()
)
