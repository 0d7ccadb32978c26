"""Appendix D on its own bench: the actuator alone, 150 counts every 4 s."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from macromicro.kernel import compiled, kernel
from macromicro.plant import cycle
from procedures.figure import DT, Array, Figure


@kernel
def _cycle(p: Any, s: Any, reference: Array, dt: float, out: Array) -> Any:
    """PID on counts, Kp 0.5, KD 0.1, KI 0.5, integrating only where that leads back into
    0-5 V (as printed, without, it drifts); counts into `out`."""
    integral, before = 0.0, 0.0
    for k in range(len(reference)):
        out[k] = cycle.measure(p, s, k * dt).encoder
        error = reference[k] - out[k]
        wanted = 0.5 * error + integral + 0.1 * (error - before)
        if 0.0 <= wanted <= 5.0 or (error > 0.0 if wanted < 0.0 else error < 0.0):
            integral = integral + 0.5 * error * dt
        before = error
        s = cycle.advance(p, s, min(max(wanted, 0.0), 5.0), 0.0, dt)
    return s


def figures(spec: cycle.CycleBench | None = None, cycles: int = 40) -> list[Figure]:
    """Rise and fall times of the actuator alone, 150 counts every 4 s."""
    plant = cycle.prepare(cycle.CycleBench() if spec is None else spec)
    reference = np.tile(np.r_[np.full(2000, 150.0), np.zeros(2000)], cycles)
    count = np.empty(len(reference))
    compiled(_cycle)(plant, cycle.initial(plant), reference, DT, count)
    times = []
    for up, down in count.reshape(cycles, 2, 2000):
        there = int(np.argmax(up >= 149.0))
        zeros = np.flatnonzero(up[:there] <= 0.0)
        left = int(zeros[-1]) if len(zeros) else 0
        times.append((there * DT, (there - left) * DT, int(np.argmax(down <= 0.0)) * DT))
    tau1, tau2, fall = np.array(times).T
    lag = float((tau1 - tau2).min())
    return [
        Figure("A1", "tau1, settled", "0.23 s", 0.18, 0.30, float(tau1[-1]), "s"),
        Figure("A2", "tau2, settled", "0.18 s", 0.14, 0.24, float(tau2[-1]), "s"),
        Figure("A3", "fall time, settled", "1.2 s", 1.0, 1.45, float(fall[-1]), "s"),
        Figure("A4", "least tau1 - tau2", "above 0", 1e-3, math.inf, lag, "s"),
    ]
