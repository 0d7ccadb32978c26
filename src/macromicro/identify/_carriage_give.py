"""Compliance of a carriage at rest, and its effect on the swing that a laser sees."""

# Bristles hold a carriage at rest like a spring (Canudas de Wit et al. 1995), so small efforts and
# the swing move it by micrometres. A laser sees both: a larger share of the swinging mass, a slower
# frequency and a quicker decay. Nudges at rest measure the compliance, which corrects the swing.

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.terminal.model import Terminal

_BLOCKS = 12  # of each record: each counts as one witness
_TAPS = 16  # samples after a change of effort in which the platform may do anything
_ROUNDS = 6  # from the swing as it is seen to that without the give


class Nudged(NamedTuple):
    u: Array  # efforts sent, V; those before the first row are 0
    laser: Array  # platform, m


class Answer(NamedTuple):
    """Response to an effort at the swing's frequency."""

    way: float  # m/V
    lag: float  # behind the effort, beyond the drive's delay, s
    errors: tuple[float, float] = (0.0, 0.0)  # standard errors of both


class Give(NamedTuple):
    carriage: Answer  # to a held effort, and of its mass
    platform: Answer  # as the laser sees it: the stage on the carriage is shaken, too


def found(p: Terminal, rows: Sequence[Nudged], dt: float) -> Give:
    """Compliance of a carriage at rest, from nudges; the first samples after a change are free."""
    made = [_columns(p, r, dt) for r in rows]
    x, y = np.concatenate([c for c, _ in made]), np.concatenate([y for _, y in made])
    inverse = np.linalg.pinv(x)
    values = inverse @ y
    left = y - x @ values
    edges = np.array_split(np.arange(len(y)), _BLOCKS * len(rows))
    blocks = np.array([inverse[:, at] @ left[at] for at in edges])
    relative = blocks * math.sqrt(len(edges) / (len(edges) - 1.0))
    # y = way u - sum of d_k times the change of u k samples ago; an effort is held for a sample,
    # which makes it half of one later. What is missing in all, per way, is its mean delay.
    w = 2.0 * math.pi * p.frequency
    turn = np.exp(-1j * w * dt * np.arange(_TAPS + 1.0))
    seen = np.concatenate([[1.0], -turn[:-1] * (1.0 - turn[1])]) / np.sqrt(turn[1])
    answer = complex(seen @ values)
    off = np.log1p(relative @ seen / answer)
    platform = Answer(
        abs(answer),
        -cmath.phase(answer) / w - p.delay,
        (abs(answer) * _size(off.real), _size(off.imag) / w),
    )
    way, missing = float(values[0]), float(np.sum(values[1:])) / float(values[0])
    lag = (missing - 0.5) * dt - p.delay
    later = (relative[:, 1:].sum(axis=1) - missing * relative[:, 0]) / way
    still = 1.0 / ((1.0 + 1j * w * lag) / way - w * w / p.push)
    carriage = Answer(
        abs(still), -cmath.phase(still) / w, (_size(relative[:, 0]), _size(later) * dt)
    )
    return Give(carriage, platform)


def _size(parts: Array) -> float:
    return math.sqrt(float(parts @ parts))


def _columns(p: Terminal, r: Nudged, dt: float) -> tuple[Array, Array]:
    """Regressors (efforts and recent changes) and readings, less zero, drift and earlier swing."""
    from scipy.signal import lfilter

    w, d = 2.0 * math.pi * p.frequency, p.decay
    wd = math.sqrt(max(w * w - d * d, 1e-12))
    t = np.arange(len(r.u)) * dt
    fall = np.exp(-d * t)
    own = np.stack([np.ones(len(t)), t, fall * np.cos(wd * t), fall * np.sin(wd * t)], axis=1)
    change = np.diff(r.u, prepend=0.0)
    late = [np.concatenate([np.zeros(k), change])[: len(t)] for k in range(_TAPS)]
    turned = cmath.exp((-d + 1j * wd) * dt)
    each = []
    for one in (r.u, *(-c for c in late)):
        # A step of the carriage leaves the swing's mass behind by that: q = -g(t).
        steps = np.diff(one, prepend=0.0)
        swing = -np.real(lfilter([1.0 - 1j * d / wd], [1.0, -turned], steps))
        each.append(one + p.share * swing)
    both = np.stack([r.laser, *each], axis=1)
    basis, _ = np.linalg.qr(own)
    both -= basis @ (basis.T @ both)
    return both[:, 1:], both[:, 0]


def moved(p: Terminal, answer: Answer) -> complex:
    """Motion due to the swing, as a share of what a laser sees without it."""
    w = 2.0 * math.pi * p.frequency
    pull = (w * w + 2j * p.decay * w) / p.push  # V: the effort that pulls as the swing does
    return pull * answer.way * cmath.exp(-1j * w * answer.lag)


def stiff(p: Terminal, give: Give) -> Terminal:
    """The swing of a rigid carriage, from that of a compliant one."""
    seen = p
    for _ in range(_ROUNDS):
        frequency, decay, share = standing(p, give)
        p = p._replace(
            frequency=p.frequency * seen.frequency / frequency,
            decay=max(p.decay + seen.decay - decay, 0.0),
            share=p.share * seen.share / share,
        )
    return p


def standing(p: Terminal, give: Give) -> tuple[float, float, float]:
    """The swing as a laser sees it on a carriage at rest.

    q'' + 2 decay q' + w^2 q = -x'', x = share moved q of the carriage; the laser sees share (1 +
    moved) q.
    """
    w, heavier = 2.0 * math.pi * p.frequency, 1.0 + p.share * moved(p, give.carriage)
    root = (-p.decay + 1j * cmath.sqrt(w * w * heavier - p.decay * p.decay)) / heavier
    return abs(root) / (2.0 * math.pi), -root.real, p.share * abs(1.0 + moved(p, give.platform))


def unsure(p: Terminal, give: Give, push: float, delay: float) -> dict[str, float]:
    """Errors of the swing due to those of the compliance and of its model."""
    at = stiff(p, give)
    others = [stiff(p._replace(push=p.push + push), give)]
    late = {n: a._replace(lag=a.lag + delay) for n, a in give._asdict().items()}
    others.append(stiff(p, Give(**late)))
    for name, one in give._asdict().items():
        way, lag = one.errors
        for other in (one._replace(way=one.way + way), one._replace(lag=one.lag + lag)):
            others.append(stiff(p, give._replace(**{name: other})))
    return {
        name: math.sqrt(sum((getattr(one, name) - getattr(at, name)) ** 2 for one in others))
        for name in ("frequency", "decay", "share")
    }
