"""The law's model of a carriage: motor, friction and the swing of the belt.

    x'' = push (u(t - delay) - friction(x') sign x') - drag x' + share (w^2 q + 2 decay q')
    q'' + 2 decay q' + w^2 q = -x''
    friction(v) = coulomb + excess + breakaway exp(-(v / fade)^2)

u is the effort at the D/A in V; `excess` is the estimated deviation of the friction, V.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.schema.par import Par

_FOUND = "identify carriage, on strokes of the shipped bench"
_CHOSEN = "chosen on the shipped bench"
FEWEST = 8  # periods of a landing
MOST = 400


class Terminal(NamedTuple):
    push: Annotated[float, Par("m/s^2/V", "acceleration per effort", _FOUND, positive=True)] = 9.69
    drag: Annotated[float, Par("1/s", "rate at which speed decays", _FOUND, positive=True)] = 54.0
    coulomb: Annotated[float, Par("V", "effort that friction takes in motion", _FOUND, lo=0.0)] = (
        2.52
    )
    breakaway: Annotated[
        float, Par("V", "additional effort at rest (breakaway)", _FOUND, lo=0.0)
    ] = 0.11
    fade: Annotated[
        float,
        Par("m/s", "Stribeck speed, over which that fades", _FOUND, shown="mm/s", positive=True),
    ] = 0.104
    delay: Annotated[
        float, Par("s", "from an effort until it acts", _FOUND, shown="ms", lo=0.0, hi=0.1)
    ] = 1.43e-3
    pitch: Annotated[
        float, Par("m", "travel per count", "data sheet", shown="um", positive=True)
    ] = 200e-3 / 2800
    frequency: Annotated[
        float, Par("Hz", "of the belt's swing; 0: none is known", _FOUND, lo=0.0)
    ] = 21.8
    decay: Annotated[float, Par("1/s", "rate at which the swing decays", _FOUND, lo=0.0)] = 1.15
    share: Annotated[float, Par("1", "share of the swinging mass", _FOUND, lo=0.0, hi=1.0)] = 0.0228
    insensitivity: Annotated[
        float,
        Par(
            "1",
            "tolerated error of the swing's frequency for a start in three steps; 0: two",
            _CHOSEN,
            lo=0.0,
            hi=0.5,
        ),
    ] = 0.0
    horizon: Annotated[
        float,
        Par("s", "length of a landing", _CHOSEN, shown="ms", positive=True, hi=1.0),
    ] = 0.062
    full: Annotated[float, Par("V", "effort during the move", _CHOSEN, positive=True)] = 5.0
    reserve: Annotated[float, Par("V", "effort held in reserve for a landing", _CHOSEN, lo=0.0)] = (
        0.05
    )
    wander: Annotated[
        float, Par("V", "drift of the friction in 10 ms of motion", _CHOSEN, positive=True)
    ] = 0.07
    unknown: Annotated[
        float, Par("V", "unexplained effort in a period", _CHOSEN, positive=True)
    ] = 0.10
    wary: Annotated[
        float, Par("1", "factor on that, as it is not white noise", _CHOSEN, lo=1.0)
    ] = 2.0


class Motion(NamedTuple):
    """State of the model: place (m), speed (m/s), deflection (m) and speed of the swing (m/s)."""

    x: float
    v: float
    q: float
    s: float


@kernel
def friction(p: Terminal, excess: float, v: float) -> float:
    ratio = v / p.fade
    return max(p.coulomb + excess + p.breakaway * math.exp(-ratio * ratio), 0.0)


@kernel
def turn(
    w: float, d: float, h: float
) -> tuple[
    Annotated[float, Meaning(name="a")],
    Annotated[float, Meaning(name="b")],
    Annotated[float, Meaning(name="c")],
    Annotated[float, Meaning(name="d")],
]:
    """Transition of a damped swing over a time: q = a q + b s, s = c q + d s."""
    wd = math.sqrt(max(w * w - d * d, 1e-12))
    fall, c, o = math.exp(-d * h), math.cos(wd * h), math.sin(wd * h) / wd
    return fall * (c + d * o), fall * o, -fall * w * w * o, fall * (c - d * o)


@kernel
def swung(
    p: Terminal, q: float, s: float, kick: float, h: float
) -> tuple[Annotated[float, Meaning(name="q")], Annotated[float, Meaning(name="s")]]:
    """The swing after a time in which its suspension gained speed evenly."""
    w = 2.0 * math.pi * p.frequency
    if w <= p.decay:
        return 0.0, 0.0
    a, b, c, d = turn(w, p.decay, h)
    s = s - 0.5 * kick
    return a * q + b * s, c * q + d * s - 0.5 * kick


@kernel
def moved(p: Terminal, m: Motion, excess: float, u: float, h: float) -> Motion:
    """The model after a time under one effort, with stiction."""
    f = friction(p, excess, m.v)
    w = 2.0 * math.pi * p.frequency
    back = p.share * (w * w * m.q + 2.0 * p.decay * m.s)
    x, v = m.x, 0.0
    sign = 0.0
    if m.v != 0.0:
        sign = math.copysign(1.0, m.v)
    elif abs(u) > f:
        sign = math.copysign(1.0, u)
    if sign != 0.0:
        fall = math.exp(-p.drag * h)
        v = fall * m.v + (p.push * (u - f * sign) + back) * (1.0 - fall) / p.drag
        if v * sign < 0.0:  # it stops on the way
            part = m.v / (m.v - v)
            x, v = m.x + 0.5 * part * h * m.v, 0.0
        else:
            x = m.x + 0.5 * h * (m.v + v)
    q, s = swung(p, m.q, m.s, v - m.v, h)
    return Motion(x, v, q, s)
