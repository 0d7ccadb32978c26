"""The full actuator model of Section 5.2.3: gain, heating, cooling, hysteresis table.

CTRL -> (5.8) -> (5.6), or (5.9) while it cools -> (5.1) -> contraction. It knows no
stress, no latent heat and no fan: at large inputs it agrees in kind only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.hysteresis import Everett, Memory, advance, fresh
from macromicro.kernel import compiled, kernel
from macromicro.models import heating
from macromicro.models.heating import Heat, Modes
from macromicro.models.weighted_gain import Weighted, weighted


class Hysteresis(NamedTuple):
    """The kiln's table: relays over temperature.

    Attributes
    ----------
    table : Everett
        Thresholds in deg C, output 0 to 1.
    low : float
        Position for an output of 0, mm.
    span : float
        Positions from there to an output of 1, mm.
    """

    table: Everett
    low: float
    span: float


class Actuator(NamedTuple):
    """Parameters of the model of Section 5.2.3.

    Attributes
    ----------
    gain : Weighted
        (5.8).
    heating : Modes
        Modes of (5.6).
    cool_time : float
        Time constant of (5.9), s.
    ambient : float
        deg C.
    hysteresis : Hysteresis
        (5.1).
    """

    gain: Weighted
    heating: Modes
    cool_time: float
    ambient: float
    hysteresis: Hysteresis


class ActuatorState(NamedTuple):
    """State of the model.

    Attributes
    ----------
    heat : Heat
        Parts of the temperature, K above ambient.
    memory : Memory
        Memory of the relays.
    x : float
        Contraction, mm.
    """

    heat: Heat
    memory: Memory
    x: float


def cold(p: Actuator) -> ActuatorState:
    """The actuator at ambient temperature, extended.

    Parameters
    ----------
    p : Actuator
        Parameters of the model.

    Returns
    -------
    ActuatorState
        State; its memory is its own.
    """
    memory = fresh(p.hysteresis.table, p.ambient)
    return ActuatorState(heating.COLD, memory, p.hysteresis.low)


@kernel
def temperature(p: Actuator, s: ActuatorState) -> float:
    """Temperature of the wires.

    Parameters
    ----------
    p : Actuator
        Parameters of the model.
    s : ActuatorState
        State of the model.

    Returns
    -------
    float
        deg C.
    """
    return p.ambient + s.heat.m1 + s.heat.m2 + s.heat.m3


@kernel
def step(p: Actuator, s: ActuatorState, ctrl: float, dt: float) -> ActuatorState:
    """The actuator after one step.

    It cools by (5.9) where the input asks for less than the present temperature, else it heats by
    (5.6). The thesis has the two side by side and does not say how they join.

    Parameters
    ----------
    p : Actuator
        Parameters of the model.
    s : ActuatorState
        State of the model; its memory is changed in place.
    ctrl : float
        CTRL, V.
    dt : float
        Length of the step, s.

    Returns
    -------
    ActuatorState
        New state.
    """
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
    """Contraction and temperature for a course of CTRL, from cold.

    Parameters
    ----------
    p : Actuator
        Parameters of the model.
    ctrl : array_like, shape (n,)
        CTRL, V.
    dt : npt.ArrayLike
        One period for all, or one for each sample, s.

    Returns
    -------
    x : ndarray, shape (n,)
        Contraction before CTRL k acts, mm.
    temperature : ndarray, shape (n,)
        Likewise, deg C.
    """
    sent = np.ascontiguousarray(ctrl, dtype=np.float64)
    out = np.empty((2, len(sent)))
    steps = np.ascontiguousarray(np.broadcast_to(np.asarray(dt, np.float64), sent.shape))
    compiled(_rollout)(p, cold(p), sent, steps, out)
    return out[0], out[1]
