"""An improved actuator model: a stress-corrected table, three heat nodes, latent heat."""

# Beyond Section 5.2.3: stress shifts the transformation temperatures (Clausius-Clapeyron),
# transformation takes and gives heat, cooling is the same ladder as heating, and the driver cuts
# the current at full contraction.

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.hysteresis import Memory, advance, fresh, peek
from macromicro.kernel import compiled, kernel
from macromicro.models.actuator import Hysteresis
from macromicro.models.heating import Ladder


class Stressed(NamedTuple):
    volts: Annotated[Array, Meaning("points of the static map, CTRL, rising", "V")]
    heat: Annotated[
        Array, Meaning("heat there, K: one K of heat warms the wires by r1 + r2 + r3 K in the end")
    ]
    lag: Annotated[float, Meaning("lag of driver and sensor together", "s")]
    ladder: Annotated[Ladder, Meaning("wire, plates and body")]
    latent: Annotated[
        float, Meaning("heat of the full transformation over the wires' capacity", "K")
    ]
    shift: Annotated[float, Meaning("the relays see the temperature less this at extension", "K")]
    stiffening: Annotated[float, Meaning("and less this per contraction", "K/mm")]
    cut_on: Annotated[float, Meaning("contraction at which CONTRACT takes the current away", "mm")]
    cut_off: Annotated[float, Meaning("contraction below which it gives it back", "mm")]
    ambient: Annotated[float, Meaning("", "degC")]
    hysteresis: Annotated[Hysteresis, Meaning("the kiln's table")]


class StressedState(NamedTuple):
    heat: Annotated[float, Meaning("delivered", "K")]
    cut: Annotated[float, Meaning("whether CONTRACT cuts it, 0 or 1")]
    wire: Annotated[float, Meaning("K above ambient", "K")]
    plates: Annotated[float, Meaning("K above ambient", "K")]
    body: Annotated[float, Meaning("K above ambient", "K")]
    content: Annotated[float, Meaning("the wire's temperature and latent share", "K")]
    memory: Annotated[Memory, Meaning("memory of the relays")]
    x: Annotated[float, Meaning("contraction", "mm")]


def cold(p: Stressed) -> StressedState:
    """The actuator at ambient temperature, extended."""
    u = p.ambient - p.shift
    memory = fresh(p.hysteresis.table, u)
    return StressedState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, memory, p.hysteresis.low)


@kernel
def static_heat(p: Stressed, ctrl: float) -> float:
    """Heat for a CTRL voltage: linear between the map's points, constant beyond."""
    last = len(p.volts) - 1
    if ctrl <= p.volts[0]:
        return float(p.heat[0])
    for i in range(last):
        if ctrl <= p.volts[i + 1]:
            share = (ctrl - p.volts[i]) / (p.volts[i + 1] - p.volts[i])
            return float(p.heat[i] + share * (p.heat[i + 1] - p.heat[i]))
    return float(p.heat[last])


@kernel
def level(p: Stressed, heat: float) -> float:
    """CTRL for a heat: the inverse of `static_heat`."""
    if heat <= p.heat[0]:
        return 0.0
    for i in range(len(p.volts) - 1):
        if heat <= p.heat[i + 1]:
            share = (heat - p.heat[i]) / (p.heat[i + 1] - p.heat[i])
            return float(p.volts[i] + share * (p.volts[i + 1] - p.volts[i]))
    return float(p.volts[len(p.volts) - 1])


@kernel
def content_at(p: Stressed, memory: Memory, u: float) -> float:
    """Heat content of the wires at a relay input, with which it rises; `u` in deg C."""
    share = peek(p.hysteresis.table, memory, u)
    stretch = p.stiffening * p.hysteresis.span * share
    return u + p.shift + stretch - p.ambient + p.latent * share


@kernel
def _relay_input(p: Stressed, memory: Memory, content: float) -> float:
    """The relay input [degC] with this content: false position in a bracket (Illinois)."""
    # The content rises at least as fast as u, so the root is no further away than the present
    # residual.
    a = memory.u
    fa = content_at(p, memory, a) - content
    if abs(fa) < 1e-9:
        return a
    b = a - fa * 1.000001
    fb = content_at(p, memory, b) - content
    for _ in range(60):
        u = b - fb * (b - a) / (fb - fa)
        f = content_at(p, memory, u) - content
        if abs(f) < 1e-9:
            return u
        if f * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = u, f
    return b


@kernel
def step(p: Stressed, s: StressedState, ctrl: float, dt: float) -> StressedState:
    """The actuator after one step."""
    cut = 1.0 if s.x >= p.cut_on else (0.0 if s.x < p.cut_off else s.cut)
    return warmed(p, s, ctrl, cut, dt)


@kernel
def warmed(p: Stressed, s: StressedState, ctrl: float, cut: float, dt: float) -> StressedState:
    """`step` with the time for which CONTRACT cuts the current."""
    goal = (1.0 - cut) * static_heat(p, ctrl)
    heat, mean = goal, goal
    if p.lag > 0.0:
        left = math.exp(-dt / p.lag)
        heat = goal + (s.heat - goal) * left
        mean = goal + (s.heat - goal) * (1.0 - left) * p.lag / dt
    return exchanged(p, s, heat, mean, cut, 0.0, dt)


@kernel
def exchanged(
    p: Stressed, s: StressedState, heat: float, mean: float, cut: float, growth: float, dt: float
) -> StressedState:
    """The actuator after a step with a given heat."""
    n = p.ladder
    out1 = (s.wire - s.plates) / n.r1 * (1.0 + growth * s.wire)
    out2 = (s.plates - s.body) / n.r2
    out3 = s.body / n.r3
    content = s.content + (mean - out1) * dt / n.c1
    plates = s.plates + (out1 - out2) * dt / n.c2
    body = s.body + (out2 - out3) * dt / n.c3
    u = _relay_input(p, s.memory, content)
    memory, share = advance(p.hysteresis.table, s.memory, u)
    # Elastic terms are in the table, as the kiln saw them, and in the stiffening.
    wire = content - p.latent * share
    x = p.hysteresis.low + p.hysteresis.span * share
    return StressedState(heat, cut, wire, plates, body, content, memory, x)


@kernel
def _rollout(
    p: Stressed, s: StressedState, ctrl: Array, cut: Array, dt: Array, out: Array
) -> StressedState:
    """Contraction [mm], wire and body temperature [degC] into `out` (3, n)."""
    for k in range(len(ctrl)):
        out[0, k] = s.x
        out[1, k] = p.ambient + s.wire
        out[2, k] = p.ambient + s.body
        if math.isnan(cut[k]):
            s = step(p, s, ctrl[k], dt[k])
        else:
            s = warmed(p, s, ctrl[k], cut[k], dt[k])
    return s


def simulate(
    p: Stressed, ctrl: npt.ArrayLike, dt: npt.ArrayLike, cut: npt.ArrayLike = np.nan
) -> Array:
    """Contraction, wire and body temperature for CTRL over time, from cold."""
    sent = np.ascontiguousarray(ctrl, dtype=np.float64)
    out = np.empty((3, len(sent)))
    steps = np.ascontiguousarray(np.broadcast_to(np.asarray(dt, np.float64), sent.shape))
    cuts = np.ascontiguousarray(np.broadcast_to(np.asarray(cut, np.float64), sent.shape))
    compiled(_rollout)(p, cold(p), sent, cuts, steps, out)
    return out
