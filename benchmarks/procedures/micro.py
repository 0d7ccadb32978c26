"""Section 5.2 on the bench: kiln, steady temperatures, dynamics, cooling, stop; laser noise."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lti
from scipy.signal import step as step_response

from macromicro.control.calibration import shipped
from macromicro.kernel import compiled, kernel
from macromicro.plant import bench, micro, wire
from macromicro.plant.wire import Load
from macromicro.rig.twin import noise_source
from macromicro.types import Outputs
from procedures.figure import DT, Array, Figure

LEVELS = (1.5, 1.525, 1.55, 1.575, 1.6)


@kernel
def _heat(p: Any, s: Any, ctrl: Array, noise: Array, dt: float, out: Array) -> Any:
    """Open loop: contraction [m] and laser [m] under CTRL voltages, into `out` (2, periods)."""
    for k in range(len(ctrl)):
        sample = bench.measure(p, s, k * dt, noise[k, 0], noise[k, 1])
        out[0, k] = s.micro.wire.x
        out[1, k] = sample.laser
        s = bench.advance(p, s, Outputs(0.0, ctrl[k], 0.0, 0.0), noise[k, 2], dt)
    return s


@kernel
def _temper(p: Any, load: Any, table: Any, s: Any, temperature: Array, out: Array) -> Any:
    """Contraction [m] of the wires at imposed temperatures [degC]."""
    for k in range(len(temperature)):
        s = wire.tempered(p, load, table, s, temperature[k])
        out[k] = s.x
    return s


def heated(plant: Any, ctrl: Array) -> Array:
    """Contraction [m] and laser [m], an array (2, periods), for CTRL from cold."""
    noise = noise_source(0).standard_normal((len(ctrl), bench.NOISES))
    out = np.empty((2, len(ctrl)))
    compiled(_heat)(plant, bench.initial(plant), np.asarray(ctrl, float), noise, DT, out)
    return out


def kiln_curve(plant: Any, temperature: Array) -> Array:
    """Contraction [m] in the kiln, quasi-static, from 25 degC along `temperature` [degC]."""
    p, load = plant.micro.wire, Load(plant.micro.wire.reference_load, 0.0, 0.0)
    start = micro.cold_wire(p, load, plant.micro.table, 25.0)
    out = np.empty(len(temperature))
    compiled(_temper)(p, load, plant.micro.table, start, temperature, out)
    return out


class Heating(NamedTuple):
    """Kiln's heating curve up to the stop: temperatures [degC] and contractions [m]."""

    temperature: Array
    contraction: Array

    def inferred(self, x: Array) -> Array:
        """Temperature [degC] that Section 5.2.2 infers from a contraction [m]."""
        return np.asarray(np.interp(x, self.contraction, self.temperature))


def heating(plant: Any) -> Heating:
    """The monotone heating curve under 30 g."""
    grid = np.linspace(25.0, 115.0, 3601)
    x = kiln_curve(plant, grid)
    last = int(np.argmax(x >= plant.micro.wire.stop - 1e-9)) + 1
    return Heating(grid[:last], x[:last])


def reference_step(t: Array) -> Array:
    """Step response of (5.6), scaled to end at 1."""
    _, y = step_response(lti([1.001, 0.1483, 0.001552], [1.0, 1.491, 0.1604, 0.001537]), T=t)
    return np.asarray(y) / (0.001552 / 0.001537)


def ladder_error(plant: Any, curve: Heating | None = None) -> float:
    """NRMSE [%] over 30 s of a 1.575 V step's inferred temperature against (5.6), both
    scaled to the end of a minute (S7)."""
    curve = heating(plant) if curve is None else curve
    t = np.arange(60_000) * DT
    rise = curve.inferred(heated(plant, np.full(60_000, 1.575))[0]) - 25.0
    ref = reference_step(t)
    mine, theirs = (rise / rise[-1])[:30_000], (ref / ref[-1])[:30_000]
    return float(100.0 * np.sqrt(np.mean((mine - theirs) ** 2)) / np.ptp(theirs))


def cooling_time(plant: Any, curve: Heating) -> float:
    """63 % time [s] of the inferred cooling from 1.575 V held for 10 s to 0 V (S8)."""
    x = heated(plant, np.r_[np.full(10_000, 1.575), np.zeros(6_000)])[0]
    top = float(curve.inferred(x[9_999:10_000])[0])
    up, down = np.linspace(25.0, top, 2000), np.linspace(top, 25.0, 4000)
    back = kiln_curve(plant, np.r_[up, down])[2000:]
    seen = np.interp(x[10_000:], back[::-1], down[::-1])
    return float(np.argmax(seen < top - 0.632 * (top - 25.0)) * DT)


def gain_5_5(ctrl: float) -> float:
    """Steady temperature above 25 degC by (5.5) [K]."""
    return 25.5 * (1.0 - math.exp(-37.86 * (ctrl - 1.5))) + 57.66


def figures(plant: Any) -> list[Figure]:
    """S3 to S8, and the slope of the Hall calibration (D6)."""
    curve = heating(plant)
    full = float(curve.temperature[-1])
    done = [Figure("S6", "full contraction in the kiln", "107.5 degC", 106.0, 109.0, full, "degC")]
    for ctrl in LEVELS:
        end = heated(plant, np.full(200_000, ctrl))[0][-1:]
        rise, printed = float(curve.inferred(end)[0]) - 25.0, gain_5_5(ctrl)
        what = f"inferred after 200 s at {ctrl:g} V"
        done.append(Figure("S5", what, f"{printed:.1f} K", printed - 3.0, printed + 3.0, rise, "K"))
    most = {c: 1e3 * float(heated(plant, np.full(60_000, c))[0].max()) for c in (1.3, 1.6, 1.7)}
    cooling = cooling_time(plant, curve)
    fit = ladder_error(plant, curve)
    slope = np.diff(shipped().position) / (1e3 * shipped().step)
    return [
        *done,
        Figure("S7", "1.575 V step against (5.6), NRMSE", "-", 0.0, 5.0, fit, "%"),
        Figure("S8", "cooling, 63 % time", "1 s", 0.8, 1.3, cooling, "s"),
        Figure("S3", "stop reached at 1.7 V", "3.98 mm", 3.96, 4.0, most[1.7], "mm"),
        Figure("S3", "not reached at 1.6 V", "below 3.98", 0.0, 3.96, most[1.6], "mm"),
        Figure("S4", "contraction at 1.3 V", "none", 0.0, 20.0, 1e3 * most[1.3], "um"),
        Figure("D6", "Hall slope, mean", "0.8", 0.75, 0.85, 1e3 * float(slope.mean()), "um/mV"),
    ]


def laser_at_rest(plant: Any) -> list[Figure]:
    """Figure 6.6: half peak to peak over 10 s."""
    half = 0.5e6 * float(np.ptp(heated(plant, np.zeros(10_000))[1]))
    return [Figure("I5", "laser noise, half peak to peak", "2 um", 1.5, 2.5, half, "um")]
