"""A smooth random function of one argument, the same in every run: value noise.

Random numbers stand at the whole arguments, hashed from them, and a cubic joins them (Perlin, An
image synthesizer, SIGGRAPH 1985, in one dimension). What changes over a way or a time at random
follows from it without a state of its own.
"""

from __future__ import annotations

import math

from macromicro.kernel import kernel

_PRIME = 65521.0  # the largest below 2**16: products stay whole numbers in a double
_ROUNDS = 4


@kernel
def _remainder(h: float) -> float:
    """Of a division by the prime: `fmod`, which compiled kernels have not."""
    return h - _PRIME * math.floor(h / _PRIME)


@kernel
def node(seed: float, k: float) -> float:
    """The random number at a whole argument.

    Parameters
    ----------
    seed : float
        Which function, a whole number.
    k : float
        Whole number.

    Returns
    -------
    float
        Uniform over -sqrt(3) to sqrt(3): mean 0, standard deviation 1.
    """
    h = _remainder(k + 7919.0 * seed)
    for _ in range(_ROUNDS):
        h = _remainder((h + 12345.0) * (3.0 * h + 1013.0))
    return math.sqrt(3.0) * (2.0 * h / _PRIME - 1.0)


@kernel
def at(seed: float, s: float) -> float:
    """The function at any argument.

    Parameters
    ----------
    seed : float
        Which function, a whole number.
    s : float
        In correlation lengths.

    Returns
    -------
    float
        Within -sqrt(3) to sqrt(3), continuous with its slope.
    """
    k = math.floor(s)
    r = s - k
    ease = r * r * (3.0 - 2.0 * r)
    low = node(seed, k)
    return low + ease * (node(seed, k + 1.0) - low)
