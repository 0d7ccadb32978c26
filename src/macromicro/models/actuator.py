"""The full actuator model of Section 5.2.3: gain, heating, cooling, hysteresis table.

CTRL -> (5.8) -> (5.6), or (5.9) while it cools -> (5.1) -> contraction. No stress, latent heat or
fan.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.hysteresis import Everett, Memory, advance, fresh
from macromicro.kernel import compiled, kernel
from macromicro.models import heating
from macromicro.models.heating import Heat, Modes
from macromicro.models.weighted_gain import Weighted, weighted


class Hysteresis(NamedTuple):
    """The kiln's table: relays over temperature."""

    table: Annotated[Everett, Meaning("thresholds in deg C, output 0 to 1")]
    low: Annotated[float, Meaning("position for an output of 0", "mm")]
    span: Annotated[float, Meaning("positions from there to an output of 1", "mm")]


class Actuator(NamedTuple):
    gain: Weighted  # (5.8)
    heating: Modes  # modes of (5.6)
    cool_time: float  # time constant of (5.9), s
    ambient: float  # deg C
    hysteresis: Hysteresis  # (5.1)


class ActuatorState(NamedTuple):
    heat: Heat  # parts of the temperature, K above ambient
    memory: Memory  # memory of the relays
    x: float  # contraction, mm


def cold(p: Actuator) -> ActuatorState:
    """The actuator at ambient temperature, extended."""
    memory = fresh(p.hysteresis.table, p.ambient)
    return ActuatorState(heating.COLD, memory, p.hysteresis.low)


@kernel
def temperature(p: Actuator, s: ActuatorState) -> float:
    """Temperature of the wires, deg C."""
    return p.ambient + s.heat.m1 + s.heat.m2 + s.heat.m3


@kernel
def step(p: Actuator, s: ActuatorState, ctrl: float, dt: float) -> ActuatorState:
    """The actuator after one step: (5.9) above the commanded temperature, else (5.6)."""
    goal = weighted(p.gain, ctrl)
    whole = p.heating.share1 + p.heating.share2 + p.heating.share3
    if whole * goal < s.heat.m1 + s.heat.m2 + s.heat.m3:
        heat = heating.cooled(p.heating, s.heat, goal, p.cool_time, dt)
    else:
        heat = heating.heated(p.heating, s.heat, goal, dt)
    now = p.ambient + heat.m1 + heat.m2 + heat.m3
    memory, share = advance(p.hysteresis.table, s.memory, now)
    return ActuatorState(heat, memory, p.hysteresis.low + p.hysteresis.span * share)


@kernel
def _rollout(p: Actuator, s: ActuatorState, ctrl: Array, dt: Array, out: Array) -> ActuatorState:
    """Contraction [mm] and temperature [degC] into `out` (2, n), before each step."""
    for k in range(len(ctrl)):
        out[0, k] = s.x
        out[1, k] = temperature(p, s)
        s = step(p, s, ctrl[k], dt[k])
    return s


def simulate(p: Actuator, ctrl: npt.ArrayLike, dt: npt.ArrayLike) -> tuple[Array, Array]:
    """Contraction [mm] and temperature [deg C] for CTRL over time, from cold."""
    sent = np.ascontiguousarray(ctrl, dtype=np.float64)
    out = np.empty((2, len(sent)))
    steps = np.ascontiguousarray(np.broadcast_to(np.asarray(dt, np.float64), sent.shape))
    compiled(_rollout)(p, cold(p), sent, steps, out)
    return out[0], out[1]
