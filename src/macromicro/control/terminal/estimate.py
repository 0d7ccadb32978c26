"""A Kalman filter of position, speed and excess friction from quantized counts.

The update takes the moments of the Gaussian truncated to the count (Duan, Jilkov, Li, State
estimation with quantized measurements, 2008).
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.control.terminal import model
from macromicro.control.terminal.model import Motion, Terminal
from macromicro.kernel import kernel

_ROOT2, _NORM = math.sqrt(2.0), 1.0 / math.sqrt(2.0 * math.pi)
_LEAST = 1e-6  # of the probability between two edges; below, the edge itself is believed
_STARTED = 5e-3  # m/s: speed of a carriage that was taken to stand
_MOST = 0.5  # of the Coulomb friction: the greatest excess that is believed
FIRST = 0.1  # V, standard deviation of the friction before any motion


class Spread(NamedTuple):
    """Covariance of position (m), speed (m/s), excess friction (V) and the swing (q m, s m/s)."""

    xx: float
    xv: float
    xf: float
    vv: float
    vf: float
    ff: float
    qx: float
    qv: float
    qf: float
    sx: float
    sv: float
    sf: float


class Belief(NamedTuple):
    """Estimated state of the carriage."""

    motion: Annotated[Motion, Meaning("its state")]
    excess: Annotated[float, Meaning("friction beyond the model's", "V")]
    spread: Annotated[Spread, Meaning("how well that is known")]


@kernel
def standing(p: Terminal, reading: float, excess: float) -> Belief:
    """At rest within a count."""
    wide = p.pitch * p.pitch / 12.0
    return Belief(
        Motion(reading + 0.5 * p.pitch, 0.0, 0.0, 0.0),
        excess,
        Spread(wide, 0.0, 0.0, 0.0, 0.0, FIRST * FIRST, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )


@kernel
def _swung(
    p: Terminal, c: Spread, fall: float, gain: float, lead: float, loose: float, h: float
) -> tuple[float, float, float, float, float, float]:
    """The covariance with the swing a time later.

    (x, v, f) -> (x + h v + lead f, fall v + gain f + loose, f); half of the speed change excites
    the swing before it turns, half afterwards (`model.swung`).
    """
    w = 2.0 * math.pi * p.frequency
    if w <= p.decay:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    m11, m12, m21, m22 = model.turn(w, p.decay, h)
    to_q, to_s, r = -0.5 * m12, -0.5 * (m22 + 1.0), fall - 1.0
    kx, kv, kf = r * c.xv + gain * c.xf, r * c.vv + gain * c.vf, r * c.vf + gain * c.ff
    qx, sx = m11 * c.qx + m12 * c.sx + to_q * kx, m21 * c.qx + m22 * c.sx + to_s * kx
    qv, sv = m11 * c.qv + m12 * c.sv + to_q * kv, m21 * c.qv + m22 * c.sv + to_s * kv
    qf, sf = m11 * c.qf + m12 * c.sf + to_q * kf, m21 * c.qf + m22 * c.sf + to_s * kf
    noise = loose * loose
    return (
        qx + h * qv + lead * qf, fall * qv + gain * qf + to_q * noise, qf,
        sx + h * sv + lead * sf, fall * sv + gain * sf + to_s * noise, sf,
    )  # fmt: skip


@kernel
def later(p: Terminal, b: Belief, u: float, h: float) -> Belief:
    now = model.moved(p, b.motion, b.excess, u, h)
    c = b.spread
    if now.v == 0.0:  # at rest: the speed is known
        still = Spread(c.xx, 0.0, c.xf, 0.0, 0.0, c.ff, c.qx, 0.0, c.qf, c.sx, 0.0, c.sf)
        qx, qv, qf, sx, sv, sf = _swung(p, still, 1.0, 0.0, 0.0, 0.0, h)
        still = Spread(c.xx, 0.0, c.xf, 0.0, 0.0, c.ff, qx, qv, qf, sx, sv, sf)
        return Belief(now, b.excess, still)
    sign = 1.0 if now.v > 0.0 else -1.0
    fall = math.exp(-p.drag * h)
    gain = -sign * p.push * (1.0 - fall) / p.drag  # speed per excess friction
    # (x, v, f) -> (x + h v + h gain f / 2, fall v + gain f, f)
    lead = 0.5 * h * gain
    xv = fall * (c.xv + h * c.vv + lead * c.vf) + gain * (c.xf + h * c.vf + lead * c.ff)
    xf = c.xf + h * c.vf + lead * c.ff
    xx = c.xx + h * (2.0 * c.xv + h * c.vv) + lead * (2.0 * (c.xf + h * c.vf) + lead * c.ff)
    vv = fall * (fall * c.vv + 2.0 * gain * c.vf) + gain * gain * c.ff
    vf = fall * c.vf + gain * c.ff
    loose = gain * p.unknown * p.wary
    wander = p.wander * p.wander * h / 0.01
    qx, qv, qf, sx, sv, sf = _swung(p, c, fall, gain, lead, loose, h)
    vv, ff = vv + loose * loose, c.ff + wander
    return Belief(now, b.excess, Spread(xx, xv, xf, vv, vf, ff, qx, qv, qf, sx, sv, sf))


@kernel
def _between(mean: float, deviation: float, low: float, high: float) -> float:
    """Probability that a Gaussian lies between two edges."""
    a, b = (low - mean) / deviation, (high - mean) / deviation
    return 0.5 * (math.erf(b / _ROOT2) - math.erf(a / _ROOT2))


@kernel
def _known(p: Terminal, b: Belief) -> float:
    """Variance of the position, at least 0.01 counts squared."""
    return max(b.spread.xx, 1e-4 * p.pitch * p.pitch)


@kernel
def likely(p: Terminal, b: Belief, reading: float) -> float:
    """Probability of a count."""
    return _between(b.motion.x, math.sqrt(_known(p, b)), reading, reading + p.pitch)


@kernel
def _cut(mean: float, deviation: float, low: float, high: float) -> tuple[float, float, bool]:
    """Moments of a Gaussian between two edges, and whether that was plausible."""
    a, b = (low - mean) / deviation, (high - mean) / deviation
    inside = _between(mean, deviation, low, high)
    if inside < _LEAST:  # the model is wrong: just behind the nearer edge
        width = high - low
        return (low + 0.05 * width if a > 0.0 else high - 0.05 * width), 0.01 * width * width, False
    pa, pb = _NORM * math.exp(-0.5 * a * a), _NORM * math.exp(-0.5 * b * b)
    shift = (pa - pb) / inside
    shrunk = 1.0 + (a * pa - b * pb) / inside - shift * shift
    return mean + deviation * shift, deviation * deviation * max(shrunk, 1e-6), True


@kernel
def seen(p: Terminal, b: Belief, reading: float) -> Belief:
    """The belief after a count; one that contradicts it resets speed and friction."""
    c, m = b.spread, b.motion
    xx = _known(p, b)
    x, variance, plausible = _cut(m.x, math.sqrt(xx), reading, reading + p.pitch)
    off, less = x - m.x, xx - variance
    if not plausible:
        v = m.v if m.v != 0.0 else math.copysign(_STARTED, off)
        more = 100.0 * _STARTED * _STARTED  # of a speed that has shaken the swing as well
        return Belief(
            Motion(x, v, m.q, m.s - (v - m.v)),
            b.excess,
            Spread(
                variance,
                0.0,
                0.0,
                c.vv + more,
                0.0,
                max(c.ff, FIRST * FIRST),
                0.0,
                c.qv,
                0.0,
                0.0,
                c.sv - more,
                0.0,
            ),
        )
    kv, kf, kq, ks = c.xv / xx, c.xf / xx, c.qx / xx, c.sx / xx
    v = m.v + kv * off
    if m.v != 0.0 and v * m.v < 0.0:
        v = 0.0
    most = _MOST * p.coulomb
    return Belief(
        Motion(x, v, m.q + kq * off, m.s + ks * off),
        min(max(b.excess + kf * off, -most), most),
        Spread(
            variance,
            c.xv - kv * less,
            c.xf - kf * less,
            max(c.vv - kv * kv * less, 0.0),
            c.vf - kv * kf * less,
            max(c.ff - kf * kf * less, 0.0),
            c.qx - kq * less,
            c.qv - kq * kv * less,
            c.qf - kq * kf * less,
            c.sx - ks * less,
            c.sv - ks * kv * less,
            c.sf - ks * kf * less,
        ),
    )
