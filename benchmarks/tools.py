"""Speed of the tools: Preisach samples a second, fits of a record."""

from __future__ import annotations

from functools import partial

import numpy as np
from figures import Line, some, timed

from macromicro import identify
from macromicro.hysteresis import FodTable, Preisach, from_density

SAMPLES = 2_000_000
METHODS = ("least_squares", "mls", "gls", "sriv", "output_error")
DT = 1e-3


def preisach() -> dict[str, float]:
    """Samples per second on a 100 x 100 table: compiled (two inputs), and step by step."""
    rng = np.random.default_rng(0)
    weights = np.tril(rng.random((100, 100)))
    model = Preisach(FodTable.from_everett(from_density(weights, 0.0, 0.01, 101)))
    samples = some(SAMPLES)
    t = np.arange(samples)
    smooth = 0.5 + 0.5 * np.sin(0.01 * t) * np.cos(1.3e-4 * t)
    random = rng.random(samples)
    first = random[:100_000].tolist()
    return {
        "Preisach compiled, random input": samples / timed(lambda: model.run(random), 5),
        "Preisach compiled, smooth input": samples / timed(lambda: model.run(smooth), 5),
        "Preisach step by step": len(first) / timed(lambda: [model.step(u) for u in first], 5),
    }


def fits() -> dict[str, float]:
    """Time [s] of a first-order fit to 2000 samples of a binary sequence in counts."""
    rng = np.random.default_rng(0)
    u = np.repeat(np.where(rng.random(500) > 0.5, 1.0, -1.0), 4)
    speed = np.zeros(2000)
    for k in range(1, 2000):
        speed[k] = 0.95833 * speed[k - 1] + 165.72 * u[k - 1]
    counts = np.floor(np.cumsum(speed) * DT)
    y = np.diff(counts, prepend=0.0) / DT
    return {
        f"fit of 2000 samples, {name}": timed(partial(getattr(identify, name), u, y, 1, 1, DT), 10)
        for name in METHODS
    }


def lines() -> list[Line]:
    """The figures as lines of the benchmark's table."""
    goal = {"Preisach step by step": "at least 3e5"}
    found = [
        Line(name, goal.get(name, "at least 3e7"), rate, "samples/s")
        for name, rate in preisach().items()
    ]
    return found + [Line(name, "at most 20", 1e3 * s, "ms") for name, s in fits().items()]
