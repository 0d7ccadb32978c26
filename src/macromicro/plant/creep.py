"""Creep of a piezo stack: displacement that follows a step with the logarithm of time.

    x(t) = x0 (1 + share log10(t / first))

is a sum of first-order lags with time constants a decade apart (Kuhnen and Janocha 2002).
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.schema.par import Par


class Creep(NamedTuple):
    share: Annotated[
        float,
        Par(
            "1",
            "creep per decade of time, of the displacement before",
            "PI, Piezo University: 1 to 2 % per decade",
            lo=0.0,
            hi=0.1,
        ),
    ] = 0.015
    first: Annotated[
        float, Par("s", "time from which on creep counts", "PI: 0.1 s", positive=True)
    ] = 0.1
    decades: Annotated[
        int, Par("", "decades of time over which it lasts", "bench assumption", lo=0, hi=8)
    ] = 4


class CreepTable(NamedTuple):
    times: Annotated[Array, Meaning("time constants", "s")]
    share: Annotated[float, Meaning("of the input, by each lag")]


def prepare(spec: Creep) -> CreepTable:
    """Time constants a decade apart."""
    decades = np.arange(spec.decades, dtype=np.float64)
    # sum over k of 1 - exp(-t / (T 10^k)) is log10(t / T) + 1/2 + gamma / ln 10, but for a ripple:
    # T = first 10^(1/2) e^gamma meets the logarithm. gamma is Euler's constant.
    begin = spec.first * math.sqrt(10.0) * math.exp(float(np.euler_gamma))
    return CreepTable(begin * 10.0**decades, float(spec.share))


def fresh(p: CreepTable) -> Array:
    return np.zeros(p.times.size)


@kernel
def advance(p: CreepTable, lags: Array, x: float, dt: float) -> float:
    total = x
    for i in range(p.times.shape[0]):
        lags[i] = x + (lags[i] - x) * math.exp(-dt / p.times[i])
        total += p.share * lags[i]
    return float(total)
