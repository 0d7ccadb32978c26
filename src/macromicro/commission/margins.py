"""How robust gains are to what is not known: margins of a loop on what was found, and the least of
them on what it may be as well. No machine is looked at. Each kind has its plant, and draws it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from macromicro.arrays import Array
from macromicro.commission.procedure import Robustness
from macromicro.machines import loops
from macromicro.machines.loops import Complex, Margins

DRAWS = 200
SEED = 1
NEAR = 0.4  # of -1: a loop that comes nearer on a drawn model is doubtful


class Robust(NamedTuple):
    """Margins of a loop.

    Attributes
    ----------
    found : Margins
        On the model that was found.
    least : Margins
        The least of each on the models that were drawn; `crossover` as well.
    stable : int
        On how many of them the closed loop is stable.
    drawn : int
        How many there were.
    """

    found: Margins
    least: Margins
    stable: int
    drawn: int


def robust(frequency: Array, found: Complex, drawn: Iterable[Complex], poles: int) -> Robust:
    """Margins of a loop, and the least of them.

    Parameters
    ----------
    frequency : ndarray, shape (n,)
        As for `loops.modulus`, Hz.
    found : ndarray of complex, shape (n,)
        Open loop on the model that was found.
    drawn : Iterable[ndarray]
        The same on models within its uncertainty.
    poles : int
        Of the open loop at 0.

    Returns
    -------
    Robust
        Of them.
    """
    every = [(loops.margins(frequency, x), loops.modulus(x, poles) > 0.0) for x in drawn]
    least = Margins(*(_least(column) for column in zip(*(m for m, _ in every), strict=True)))
    stable = sum(one for _, one in every)
    return Robust(loops.margins(frequency, found), least, stable, len(every))


def _least(values: Sequence[float]) -> float:
    return min((v for v in values if not math.isnan(v)), default=math.nan)


def told(found: Robust, remedy: str) -> Robustness:
    """Margins in words.

    Parameters
    ----------
    found : Robust
        Of a loop.
    remedy : str
        What makes the model surer.

    Returns
    -------
    Robustness
        Margins, and whether what is not known may spoil the loop.
    """
    of = (
        ("loop's crossover", found.found.crossover, found.least.crossover, "Hz"),
        ("phase margin", found.found.phase, found.least.phase, "deg"),
        ("gain margin", found.found.gain, found.least.gain, ""),
        ("least distance of the loop from -1", found.found.modulus, found.least.modulus, ""),
    )
    rows = tuple((name, f"{v:.3g}", f">= {least:.3g}", unit) for name, v, least, unit in of)
    return Robustness(rows, tuple(_doubts(found, remedy)))


def _doubts(found: Robust, remedy: str) -> Iterator[str]:
    if found.stable < found.drawn:
        yield (
            f"On {found.drawn - found.stable} of {found.drawn} models within the uncertainty of "
            f"what was found the loop is not stable: smaller gains, or {remedy}."
        )
    elif found.least.modulus < NEAR:
        yield (
            f"On models within the uncertainty of what was found the loop comes as near as "
            f"{found.least.modulus:.2g} to -1: it may ring."
        )
