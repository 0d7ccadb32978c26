"""Records of an axis that forces and noise of its position disturb."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.identify.axis_inverse import Rows, differences
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, simulate

DT = 1e-3
TRUTH = Axis(4.0, 25.0, 12.0, 2.0)


def forces(n: int, seed: int = 0, low: float = -60.0) -> Array:
    return np.repeat(np.random.default_rng(seed).uniform(low, 60.0, n // 200), 200)


def record(
    n: int, force: float, sensor: float, seed: int = 0, axis: Axis = TRUTH, low: float = -60.0
) -> list[Rows]:
    random = np.random.default_rng(1000 + seed)
    u = forces(n, seed, low)
    x = simulate(axis, u + force * random.standard_normal(n), DT)
    x = x + sensor * random.standard_normal(n)
    return [differences(Run(np.arange(n) * DT, u, x), u, 80.0, 10)]


def slow_record(seed: int, parts: int = 1) -> list[Rows]:
    """Eight seconds under a force of 1.2 N that goes together for one."""
    n, keep = 8000, 0.999
    random = np.random.default_rng(seed)
    white = 1.2 * np.sqrt(1.0 - keep * keep) * random.standard_normal(n)
    push = lfilter([1.0], [1.0, -keep], white, zi=[keep * 1.2 * random.standard_normal()])[0]
    u = forces(n, seed)
    x = simulate(TRUTH, u + push, DT)
    return [
        differences(Run(np.arange(len(p[0])) * DT, *p), p[0], 80.0, 10)
        for p in zip(np.split(u, parts), np.split(x, parts), strict=True)
    ]
