"""Robustness of gains: margins of the loop on the identified plant and on drawn ones."""

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
    found: Margins  # on the model that was found
    least: Margins  # the least of each on the models that were drawn; `crossover` as well
    stable: int  # on how many of them the closed loop is stable
    drawn: int  # number of models


def robust(frequency: Array, found: Complex, drawn: Iterable[Complex]) -> Robust:
    every = [loops.margins(frequency, x) for x in drawn]
    crossover, phase, gain, near, stable = zip(*every, strict=True)
    least = Margins(_least(crossover), _least(phase), _least(gain), _least(near), all(stable))
    return Robust(loops.margins(frequency, found), least, sum(stable), len(every))


def _least(values: Sequence[float]) -> float:
    return min((v for v in values if not math.isnan(v)), default=math.nan)


def as_robustness(found: Robust, remedy: str) -> Robustness:
    of = (
        ("loop's crossover", found.found.crossover, found.least.crossover, "Hz"),
        ("phase margin", found.found.phase, found.least.phase, "deg"),
        ("gain margin", found.found.gain, found.least.gain, ""),
        ("modulus margin", found.found.modulus, found.least.modulus, ""),
    )
    rows = tuple((name, f"{v:.3g}", f">= {least:.3g}", unit) for name, v, least, unit in of)
    return Robustness(rows, tuple(_doubts(found, remedy)))


def _doubts(found: Robust, remedy: str) -> Iterator[str]:
    if found.stable < found.drawn:
        yield (
            f"The loop is unstable on {found.drawn - found.stable} of {found.drawn} models "
            f"within the uncertainty. Reduce the gains, or use {remedy}."
        )
    elif found.least.modulus < NEAR:
        yield (
            f"Within the uncertainty the modulus margin falls to {found.least.modulus:.2g}: "
            "the loop may ring."
        )
