"""Records of a drive whose force is another than it is said to be."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import simulate
from macromicro.identify.axis_fit import Driven, rows_of, runs_of
from macromicro.identify.axis_inverse import Rows
from macromicro.models.mass import Axis

DT = 1e-3
AXIS = Axis(mass=4.0, viscous=25.0, coulomb=12.0, offset=2.0)


def steps(seed: int, n: int = 8000) -> Array:
    """Forces of both signs, each for 0.1 to 0.5 s."""
    random = np.random.default_rng(seed)
    parts: list[Array] = []
    while sum(map(len, parts)) < n:
        parts.append(np.full(int(random.integers(100, 500)), random.uniform(-60.0, 60.0)))
    return np.concatenate([np.zeros(300), *parts])[:n]


def record(said: Array, acts: Array, seed: int = 0) -> tuple[Array, Array, Array]:
    """Times, the force as it is said to be, and the way under the one that acts, with noise."""
    random = np.random.default_rng(seed + 100)
    x = simulate(AXIS, acts + 6.0 * random.standard_normal(len(acts)), DT)
    return np.arange(len(said)) * DT, said, np.asarray(x)


def rows(said: Array, acts: Array, seed: int = 0) -> list[Rows]:
    """The same, ready for inverse dynamics."""
    return rows_of(runs_of(*record(said, acts, seed)), Driven())
