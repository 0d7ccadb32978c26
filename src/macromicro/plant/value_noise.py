"""Value noise: a smooth random function of one argument, the same in every run.

A cubic through hashed random numbers at whole arguments (Perlin, SIGGRAPH 1985).
"""

from __future__ import annotations

import math

from macromicro.kernel import kernel

_PRIME = 65521.0  # the largest below 2**16: products stay whole numbers in a double
_ROUNDS = 4


@kernel
def _remainder(h: float) -> float:
    """`fmod` by the prime, which compiled kernels lack."""
    return h - _PRIME * math.floor(h / _PRIME)


@kernel
def node(seed: float, k: float) -> float:
    h = _remainder(k + 7919.0 * seed)
    for _ in range(_ROUNDS):
        h = _remainder((h + 12345.0) * (3.0 * h + 1013.0))
    return math.sqrt(3.0) * (2.0 * h / _PRIME - 1.0)


@kernel
def at(seed: float, s: float) -> float:
    k = math.floor(s)
    r = s - k
    ease = r * r * (3.0 - 2.0 * r)
    low = node(seed, k)
    return low + ease * (node(seed, k + 1.0) - low)
