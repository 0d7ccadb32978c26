"""Section 4.2 on the bench: dead zone, speeds, linear model, discontinuous dead zone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.signal import lfilter

from macromicro.kernel import compiled, kernel
from macromicro.plant import amplifier, carriage
from macromicro.plant.bench import Sensors
from procedures.figure import DT, Array, Figure

COUNT = Sensors().encoder.pitch
TRAVEL = 2800


@kernel
def _push(p: Any, s: Any, volts: Array, dt: float, out: Array) -> Any:
    """Positions [m] of the carriage under D/A voltages, one a period, one period late."""
    latched = 0.0
    for k in range(len(volts)):
        out[k] = s.x
        drive = amplifier.motor_volts(p.amplifier, latched)
        s = carriage.advance(p.macro, s, drive, dt, p.macro_steps)
        latched = amplifier.convert(p.amplifier, volts[k])
    return s


def pushed(plant: Any, volts: float, seconds: float, start: float) -> Array:
    """Encoder counts, as they come, of a run from `start` [counts] at a constant voltage."""
    u = np.full(round(seconds / DT), volts)
    out = np.empty(len(u))
    compiled(_push)(plant, carriage.at_rest((start + 0.5) * COUNT), u, DT, out)
    return np.asarray(np.floor(out / COUNT + 1e-9))


def dead_zone(plant: Any) -> float:
    """Lowest voltage [V] that drives the carriage through, both ways and from any start."""
    for volts in np.arange(2.5, 3.5, 0.01):
        # Once it moves it must get through; it must also start wherever it stands.
        through = (
            pushed(plant, volts, 4.0, 0.0)[-1] >= TRAVEL
            and pushed(plant, -volts, 4.0, float(TRAVEL))[-1] <= 0.0
        )
        if through and all(
            way * (pushed(plant, way * volts, 1.0, start)[-1] - start) > 100.0
            for way in (1.0, -1.0)
            for start in np.arange(200.0, 2600.0, 100.0)
        ):
            return float(volts)
    return math.nan


def averaged_run(plant: Any, above: float, seconds: float) -> Array:
    """Mean counts of ten runs in turn both ways at `above` [V] beyond the dead zone."""
    rng = np.random.default_rng(0)
    runs = []
    for k in range(10):
        way = 1.0 if k % 2 == 0 else -1.0
        place = float(np.floor(rng.uniform(20.0, 80.0)))
        start = place if way > 0.0 else TRAVEL - place
        runs.append(way * (pushed(plant, way * (3.0 + above), seconds, start) - start))
    return np.asarray(np.mean(runs, axis=0))


def modified_least_squares(u: Array, y: Array) -> tuple[float, float]:
    """a and b of y(k+1) = -a y(k) + b u(k): least squares, filtered by 1/A, repeated."""
    a, b = 0.0, 0.0
    for _ in range(30):
        uf, yf = lfilter([1.0], [1.0, a], u), lfilter([1.0], [1.0, a], y)
        columns = np.column_stack([-yf[:-1], uf[:-1]])
        a, b = np.linalg.lstsq(columns, yf[1:], rcond=None)[0]
    return float(a), float(b)


def figures(plant: Any) -> list[Figure]:
    """M1 to M6."""
    counts = {above: averaged_run(plant, above, s) for above, s in ((0.1, 1.35), (1.0, 0.65))}
    counts[2.0] = averaged_run(plant, 2.0, 0.4)
    speed = {}
    for above, y in counts.items():
        half = len(y) // 2
        speed[above] = (y[-1] - y[half]) / ((len(y) - 1 - half) * DT)
    rate = np.diff(counts[1.0]) / DT
    a, b = modified_least_squares(np.full(len(rate), 1.0), rate)
    gain = b / (1.0 + a)
    # (4.7), (4.8): the line through the outputs that the gain needs at 0.1 V and 1 V.
    delta = (speed[1.0] - speed[0.1]) / gain / 0.9
    a0 = speed[0.1] / gain - 0.1 * delta
    return [
        Figure("M1", "dead zone", "3 V", 2.85, 3.15, dead_zone(plant), "V"),
        Figure("M2", "speed 0.1 V above it", "1700", 1632.0, 1768.0, speed[0.1], "counts/s"),
        Figure("M3", "speed 1 V above it", "3977", 3817.9, 4136.1, speed[1.0], "counts/s"),
        Figure(
            "M3b", "speed 2 V above it", "6507 by (4.5)", 6116.6, 6897.4, speed[2.0], "counts/s"
        ),
        Figure("M4a", "pole coefficient a", "-0.95833", -0.96233, -0.95433, a, ""),
        Figure("M4b", "gain b", "165.72", 152.46, 178.98, b, "counts/s/V"),
        Figure("M4b", "b/(1 + a)", "3977", 3857.7, 4096.3, gain, "counts/s/V"),
        Figure("M6a", "threshold output a0", "0.364 V", 0.334, 0.394, a0, "V"),
        Figure("M6b", "slope delta", "0.636", 0.606, 0.666, delta, ""),
    ]
