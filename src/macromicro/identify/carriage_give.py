"""How far a carriage that stands gives, and what that does to the swing that a laser sees.

Bristles hold a carriage that stands as a spring does (Canudas de Wit et al., A new model for
control of systems with friction, 1995): efforts far below breakaway move it by micrometres, and so
does the swing. A laser sees both together: a larger share of the swinging mass, a slower frequency
and a quicker decay than those of a carriage that slides. Nudges, small efforts to and fro at rest,
show how it gives, so that the swing's parameters follow without that.
"""

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
    """A record of nudges.

    Attributes
    ----------
    u : ndarray, shape (n,)
        Efforts sent, V; those before the first row are 0.
    laser : ndarray, shape (n,)
        Platform, m.
    """

    u: Array
    laser: Array


class Answer(NamedTuple):
    """What moves by an effort at the swing's frequency.

    Attributes
    ----------
    way : float
        m/V.
    lag : float
        Behind the effort, beyond the drive's delay, s.
    errors : tuple[float, float]
        Standard errors of both.
    """

    way: float
    lag: float
    errors: tuple[float, float] = (0.0, 0.0)


class Give(NamedTuple):
    """How a carriage that stands gives.

    Attributes
    ----------
    carriage : Answer
        By itself: as the effort is held, and by its mass.
    platform : Answer
        As the laser sees it: the stage on the carriage is shaken, too.
    """

    carriage: Answer
    platform: Answer


def found(p: Terminal, rows: Sequence[Nudged], dt: float) -> Give:
    """How a carriage that stands gives, from nudges.

    The platform's answer to a change of effort is free for some samples, since the stage on the
    carriage is shaken by it; then it stands. Beside it the swing is reckoned with that it leaves.

    Parameters
    ----------
    p : Terminal
        Model of the strokes: delay and swing, also that which is left from before.
    rows : Sequence[Nudged]
        One or more.
    dt : float
        Sample time, s.

    Returns
    -------
    Give
        With standard errors, each of several blocks of nudges as one observation (Liang and Zeger,
        1986).
    """
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
    """Standard error of a sum whose parts are independent."""
    return math.sqrt(float(parts @ parts))


def _columns(p: Terminal, r: Nudged, dt: float) -> tuple[Array, Array]:
    """Efforts, their changes some samples ago, and the readings they explain: each with the swing
    that they leave, and without what is seen beside them (zero, drift, the swing from before)."""
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
    """What the swing moves by, as a part of what a laser sees of it beside that.

    Parameters
    ----------
    p : Terminal
        The swing.
    answer : Answer
        Of carriage or platform.

    Returns
    -------
    complex
        1, at the swing's frequency: in phase, and (below 0) behind.
    """
    w = 2.0 * math.pi * p.frequency
    pull = (w * w + 2j * p.decay * w) / p.push  # V: the effort that pulls as the swing does
    return pull * answer.way * cmath.exp(-1j * w * answer.lag)


def stiff(p: Terminal, give: Give) -> Terminal:
    """The swing of a carriage that does not give, from that of one that does.

    Parameters
    ----------
    p : Terminal
        Frequency, decay and share as a laser sees them while the carriage stands.
    give : Give
        Of that carriage.

    Returns
    -------
    Terminal
        The same without it.
    """
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
    """The swing as a laser sees it on a carriage that stands.

    q'' + 2 decay q' + w^2 q = -x'', x = share moved q of the carriage, and the laser sees of the
    platform share (1 + moved) q.

    Parameters
    ----------
    p : Terminal
        Its swing.
    give : Give
        Of the carriage.

    Returns
    -------
    frequency : float
        Hz, as without its decay.
    decay : float
        1/s.
    share : float
        1.
    """
    w, heavier = 2.0 * math.pi * p.frequency, 1.0 + p.share * moved(p, give.carriage)
    root = (-p.decay + 1j * cmath.sqrt(w * w * heavier - p.decay * p.decay)) / heavier
    return abs(root) / (2.0 * math.pi), -root.real, p.share * abs(1.0 + moved(p, give.platform))


def unsure(p: Terminal, give: Give, push: float, delay: float) -> dict[str, float]:
    """What the errors of the give do to the swing, and those of the model that it was found with.

    Parameters
    ----------
    p : Terminal
        With the swing as it is seen.
    give : Give
        Of the carriage.
    push, delay : float
        Standard errors of these, m/s^2/V and s.

    Returns
    -------
    dict[str, float]
        Standard errors of frequency (Hz), decay (1/s) and share.
    """
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
