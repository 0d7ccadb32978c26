"""A carriage for terminal control: drive, friction and delay from counts, swing from a laser.

Prediction error method by maximum likelihood (Ljung, System Identification, 1999, Chapter 7).
"""

# The law's estimator gives the probability of each count in strokes from rest to rest; it also
# follows friction that changes along the rod. Standard errors of the swing take strokes of one
# effort and length as one observation (Liang and Zeger 1986). The likelihood of whole counts is too
# rough for curvatures, so the values of each record alone are reported for drive and friction.
# Nudges at rest correct the swing for the carriage's compliance (`compliance`).

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.terminal import estimate, model
from macromicro.control.terminal.estimate import Belief
from macromicro.control.terminal.model import Motion, Terminal
from macromicro.errors import ProblemError
from macromicro.identify import clusters
from macromicro.identify.records import rms
from macromicro.identify.search import halt, least_squares
from macromicro.kernel import compiled, kernel

RIGID = ("push", "drag", "coulomb", "breakaway", "fade", "delay", "unknown")
SWING = ("frequency", "decay", "share")
FEWEST = 4  # strokes
_BEFORE = 0.02  # s at rest before a stroke
_AFTER = 0.03  # s after the last count until the laser sees the swing alone
_SEEN = 0.25  # s of it at least
_ODD = 1e3  # of so many counts one may be anything near
_SIZES = (0.2, 0.05, 0.02)  # of logarithms: how far the search looks around
_WIDE = 3.0  # of logarithms, from where the search begins
_SLOWEST, _FASTEST = 2.0, 0.2  # swings in the longest window; share of the sampling frequency
_SOME = 0.02  # share of a swing to begin with: it hardly moves the carriage
_ROUNDS = 2  # of drive and friction, then share
_SMALL = 0.5  # of the least effort that moves it: what does not move it is a nudge
_WITH = ("push", "delay")  # the give is told from the motion by these
_FEW = 0.5  # s of nudges at least

Parts = list[tuple[float, float]]  # standard errors that add up, and their degrees of freedom


class Record(NamedTuple):
    u: Array  # efforts sent, V
    counts: Array  # of the encoder
    laser: Array  # platform, m; empty: not measured
    # of each: its rows [a, b), and the row from which the laser shows the swing alone (b: nowhere)
    strokes: tuple[tuple[int, int, int], ...]
    nudges: tuple[tuple[int, int], ...] = ()  # rows [a, b) of efforts far below those that move it


class CarriageFit(NamedTuple):
    # the law's parameters; those that a recording does not tell keep their defaults
    model: Terminal
    std: dict[str, float]  # standard errors of those that the laser tells, in their units
    # degrees of freedom of these: a few strokes tell the most of a swing (`clusters`)
    freedom: dict[str, float]
    # of the others: the least and the greatest of the values that each record alone gives; empty
    # for one record
    apart: dict[str, tuple[float, float]]
    surprise: float  # of a count: mean of minus the logarithm of its probability given those before
    swing_rms: float  # of the swing by the laser, m; NaN without one
    records: tuple[Record, ...]
    motion: tuple[Array, ...]  # of each record by the law's estimator, as `followed` gives it
    dt: float  # sample time, s
    # of a carriage that stands; None: no laser saw nudges, and the swing is that of one that gives
    give: Give | None = None


@kernel
def _log_probability(p: Terminal, b: Belief, reading: float) -> float:
    """Log-probability of a count given the belief; one in `_ODD` may be an outlier."""
    low, high = reading - b.motion.x, reading + p.pitch - b.motion.x
    beyond = max(low, -high, 0.0) / p.pitch
    return math.log(max(estimate.likely(p, b, reading), 0.0) + math.exp(-beyond) / _ODD)


@kernel
def _follow(p: Terminal, u: Array, counts: Array, out: Array, dt: float) -> None:
    """The law's estimator over a record: position, speed, swing, friction, log-probability."""
    late = int(p.delay / dt)
    part = p.delay - late * dt
    b = estimate.standing(p, counts[0] * p.pitch, 0.0)
    for k in range(len(u)):
        surprise = 0.0
        if k > 0:
            before = u[k - late - 2] if k > late + 1 else 0.0
            after = u[k - late - 1] if k > late else 0.0
            if part > 0.0:
                b = estimate.later(p, b, before, part)
            b = estimate.later(p, b, after, dt - part)
            surprise = -_log_probability(p, b, counts[k] * p.pitch)
            b = estimate.seen(p, b, counts[k] * p.pitch)
        m = b.motion
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = m.x, m.v, m.q, b.excess, surprise


def follow_law(p: Terminal, r: Record, dt: float) -> Array:
    out = np.empty((5, len(r.u)))
    compiled(_follow)(p, r.u, r.counts, out, dt)
    return out


def cut_strokes(t: Array, u: Array, counts: Array, laser: Array | None = None) -> Record:
    """A record cut into strokes, each from an effort after rest to the next one."""
    dt = float(t[1] - t[0])
    rest = max(round(_BEFORE / dt), 1)
    moving = (u != 0.0) | (np.diff(counts, prepend=counts[0]) != 0.0)
    busy = np.convolve(moving, np.ones(rest), "full")[: len(u)]  # of the last `rest` rows
    quiet = np.concatenate([[True], busy[:-1] == 0.0])
    begins = np.flatnonzero((u != 0.0) & quiet)
    parts = list(pairwise([*map(int, begins), len(u)]))
    ways = [int(np.ptp(counts[a:b])) for a, b in parts]
    tops = [float(np.abs(u[a:b]).max()) for a, b in parts]
    small = _SMALL * min((top for top, way in zip(tops, ways, strict=True) if way > 1), default=0.0)
    found, nudges = [], []
    for (a, b), way, top in zip(parts, ways, tops, strict=True):
        if top < small and way <= 1:  # it stands on the edge of a count, at most
            nudges.append((a, b))
            continue
        changes = np.flatnonzero(np.diff(counts[a:b]))
        if not len(changes):
            continue
        ends = max(int(changes[-1]) + 1, int(np.flatnonzero(u[a:b])[-1]) + 1)
        still = a + ends + round(_AFTER / dt)
        if laser is None or (b - still) * dt < _SEEN:
            still = b
        found.append((a, b, still))
    y = np.empty(0) if laser is None else np.ascontiguousarray(laser, dtype=np.float64)
    sent, read = (np.ascontiguousarray(c, dtype=np.float64) for c in (u, counts))
    return Record(sent, read, y, tuple(found), tuple(nudges))


def carriage(records: Sequence[Any], pitch: float) -> CarriageFit:
    dt = float(records[0][0][1] - records[0][0][0])
    rows = [cut_strokes(*r) for r in records]
    ways = [r.counts[b - 1] - r.counts[a] for r in rows for a, b, _ in r.strokes]
    if len(ways) < FEWEST:
        remedy = f"Record more, each after {_BEFORE:g} s at rest without effort."
        raise ProblemError("recordings", f"{len(ways)} of {FEWEST} strokes found", remedy)
    if not (min(ways) < 0.0 < max(ways)):
        remedy = "Record strokes in both directions."
        raise ProblemError("recordings", "all strokes go in one direction", remedy)
    p = _free(_guess(rows, dt, pitch), rows, dt)
    parts: dict[str, Parts] = {}
    left = math.nan
    if _windows(rows):
        values, parts = _ringing(rows, dt)
        p = p._replace(**values)
        p = p._replace(share=_swing_share(p._replace(share=_SOME), rows, dt)[0])
    for _ in range(_ROUNDS if parts else 1):
        p = _likeliest(p, rows, dt)
        if parts:
            share, parts["share"], left = _swing_share(p, rows, dt)
            p = p._replace(share=share)
    motion = [follow_law(p, r, dt) for r in rows]
    surprise = float(np.mean(np.concatenate([m[4] for m in motion])))
    alone = [_likeliest(p, [r], dt, _SIZES[1:]) for r in rows] if len(rows) > 1 else []
    apart = {n: (min(v), max(v)) for n in RIGID if (v := [float(getattr(q, n)) for q in alone])}
    between = float(max(len(rows) - 1, 1))  # degrees of freedom of what differs between records
    if parts:
        parts["share"] += [(off, between) for off in _share_effects(p, rows, dt, apart)]
    give = _give(p, rows, dt) if parts else None
    if give is not None:
        push, delay = (0.5 * (apart[n][1] - apart[n][0]) if apart else 0.0 for n in _WITH)
        # One delay stands for those of the efforts' hold, of a computer and of a winding.
        more = unsure(p, give, push, math.hypot(delay, dt / math.sqrt(12.0)))
        parts = {name: [*each, (more[name], between)] for name, each in parts.items()}
        p = stiff(p, give)
    p = p._replace(wary=Terminal().wary)
    std = {name: math.hypot(*(error for error, _ in each)) for name, each in parts.items()}
    free = {name: clusters.freedom(each) for name, each in parts.items()}
    return CarriageFit(p, std, free, apart, surprise, left, tuple(rows), tuple(motion), dt, give)


def _guess(rows: Sequence[Record], dt: float, pitch: float) -> Terminal:
    """Orders of magnitude from the strokes, to start the search."""
    tops = [float(np.abs(r.u[a:b]).max()) for r in rows for a, b, _ in r.strokes]
    apart = max(round(0.01 / dt), 1)
    speed = max(float(np.abs(r.counts[apart:] - r.counts[:-apart]).max()) for r in rows)
    speed *= pitch / (apart * dt)
    coulomb = 0.7 * min(tops)
    return Terminal()._replace(
        push=20.0 * speed / max(max(tops) - coulomb, 0.1 * max(tops)),
        drag=20.0,
        coulomb=coulomb,
        breakaway=0.1 * coulomb,
        fade=0.1 * speed,
        delay=1.2 * dt,
        pitch=pitch,
        frequency=0.0,
        share=0.0,
        wary=1.0,  # what is likeliest is what the counts show
    )


@kernel
def _run(p: Terminal, u: Array, out: Array, dt: float) -> None:
    """Position of the model from rest, without using counts."""
    late = int(p.delay / dt)
    part = p.delay - late * dt
    m = Motion(0.0, 0.0, 0.0, 0.0)
    for k in range(len(u)):
        out[k] = m.x
        m = model.moved(p, m, 0.0, u[k - late - 1] if k > late else 0.0, part)
        m = model.moved(p, m, 0.0, u[k - late] if k >= late else 0.0, dt - part)


def free_run(p: Terminal, r: Record, dt: float) -> Array:
    """Counts by the model, using the record only where each stroke begins."""
    out = r.counts.copy()
    for a, b, _ in r.strokes:
        x = np.empty(b - a)
        compiled(_run)(p, r.u[a:b], x, dt)
        out[a:b] = r.counts[a] + x / p.pitch
    return out


def _free(p: Terminal, rows: Sequence[Record], dt: float) -> Terminal:
    """Acceleration, drag and friction with the nearest free simulation, to start from."""
    at = np.array([p.push, p.drag, p.coulomb])

    def left(z: Array) -> Array:
        push, drag, coulomb = map(float, at * np.exp(z))
        trial = p._replace(push=push, drag=drag, coulomb=coulomb, breakaway=0.0)
        found = []
        for r in rows:
            off = r.counts - free_run(trial, r, dt)
            found += [off[a:b] for a, b, _ in r.strokes]
        return np.concatenate(found)

    found = least_squares(left, np.zeros(3), loss="soft_l1", diff_step=1e-4, x_scale=0.1)
    push, drag, coulomb = map(float, at * np.exp(found.x))
    return p._replace(push=push, drag=drag, coulomb=coulomb, breakaway=0.1 * coulomb)


def _give(p: Terminal, rows: Sequence[Record], dt: float) -> Give | None:
    """Compliance at rest from nudges before a laser; None where there are too few."""
    seen = [Nudged(r.u[a:b], r.laser[a:b]) for r in rows if len(r.laser) for a, b in r.nudges]
    if sum(len(r.u) for r in seen) * dt < _FEW:
        return None
    give = compliance(p, seen, dt)
    return give if give.carriage.way > 0.0 else None


def _windows(rows: Sequence[Record]) -> list[tuple[int, int, int]]:
    """Record and rows [a, b) of each stroke in which the laser shows the swing alone."""
    return [(k, a, b) for k, r in enumerate(rows) for _, b, a in r.strokes if a < b]


def _together(rows: Sequence[Record], each: Array) -> Array:
    """Scores summed over strokes of one effort and length, which share the model error."""
    kinds: dict[tuple[float, int], Array] = {}
    pulses = [r.u[a:b] for r in rows for a, b, still in r.strokes if still < b]
    for u, one in zip(pulses, each, strict=True):
        kind = round(float(np.abs(u).max()), 3), int(np.count_nonzero(u))
        kinds[kind] = kinds.get(kind, 0.0) + one
    return np.array(list(kinds.values())) if len(kinds) >= FEWEST else each


def _without_drift(y: Array) -> Array:
    """Without mean and slope: the laser's zero and drift."""
    k = np.linspace(-1.0, 1.0, len(y))
    return np.asarray(y - y.mean() - k * float(k @ y / (k @ k)))


def _ringing(rows: Sequence[Record], dt: float) -> tuple[dict[str, float], dict[str, Parts]]:
    """Frequency (Hz) and decay (1/s) common to all swings, with errors and degrees of freedom."""
    # In um: the search ends by absolute sizes.
    seen = [rows[k].laser[a:b] * 1e6 for k, a, b in _windows(rows)]
    longest = max(map(len, seen))
    power = sum(np.abs(np.fft.rfft(_without_drift(y), 4 * longest)) ** 2 for y in seen)
    tones = np.fft.rfftfreq(4 * longest, dt)
    allowed = (tones > _SLOWEST / (longest * dt)) & (tones < _FASTEST / dt)
    first = float(tones[allowed][int(np.argmax(np.asarray(power)[allowed]))])

    def each(z: Array) -> list[Array]:
        w, d = 2.0 * math.pi * z[0], z[1]
        found = []
        for y in seen:
            t = np.arange(len(y)) * dt
            fall = np.exp(-d * t)
            basis = np.stack([np.ones(len(t)), t, fall * np.cos(w * t), fall * np.sin(w * t)])
            found.append(y - basis.T @ np.linalg.lstsq(basis.T, y, rcond=None)[0])
        return found

    bounds = ([0.8 * first, 0.0], [1.2 * first, 2.0 * math.pi * first])
    fit = least_squares(
        lambda z: np.concatenate(each(z)), [first, 1.0], bounds=bounds, x_scale=[0.01, 0.1]
    )
    edges = np.cumsum([0, *map(len, seen)])
    slopes = [(fit.jac[a:b], fit.fun[a:b]) for a, b in pairwise(edges)]
    found = clusters.by_scores(
        _together(rows, np.array([j.T @ j for j, _ in slopes])),
        _together(rows, np.array([j.T @ e for j, e in slopes])),
    )
    free = fit.fun.size - 4 * len(seen) - 2
    white = np.linalg.pinv(fit.jac.T @ fit.jac) * float(fit.fun @ fit.fun) / max(free, 1)
    shown, decay = float(fit.x[0]), float(fit.x[1])
    natural = math.hypot(shown, decay / (2.0 * math.pi))  # a decaying swing is slower
    values = {"frequency": natural, "decay": decay}
    # Few strokes make a sandwich that is too thin: never less than white noise gives.
    errors: dict[str, Parts] = {}
    for i, name in enumerate(values):
        strokes, noise = float(found.covariance[i, i]), float(white[i, i])
        degrees = float(found.degrees()[i]) if strokes > noise else math.inf
        errors[name] = [(math.sqrt(max(strokes, noise)), degrees)]
    return values, errors


def _swing_share(p: Terminal, rows: Sequence[Record], dt: float) -> tuple[float, Parts, float]:
    """Share of the swing seen by the laser, its error, degrees of freedom and residual RMS (m)."""
    swung = [follow_law(p, r, dt)[2] for r in rows]
    pairs = [
        (_without_drift(rows[k].laser[a:b]), _without_drift(swung[k][a:b]))
        for k, a, b in _windows(rows)
    ]
    total = sum(float(q @ q) for _, q in pairs)
    share = sum(float(q @ y) for y, q in pairs) / total
    left = [y - share * q for y, q in pairs]
    found = clusters.by_scores(
        _together(rows, np.array([[[float(q @ q)]] for _, q in pairs])),
        _together(rows, np.array([[float(q @ e)] for (_, q), e in zip(pairs, left, strict=True)])),
    )
    error = [(math.sqrt(float(found.covariance[0, 0])), float(found.degrees()[0]))]
    return min(max(share, 0.0), 1.0), error, rms(left)


def _share_effects(
    p: Terminal, rows: Sequence[Record], dt: float, apart: dict[str, tuple[float, float]]
) -> list[float]:
    """Effect on the share of half the difference between records, for drive and friction."""
    found = []
    for name, ends in apart.items():
        low, high = (_swing_share(p._replace(**{name: v}), rows, dt)[0] for v in ends)
        found.append(0.5 * (high - low))
    return found


def _surprises(p: Terminal, rows: Sequence[Record], dt: float) -> Array:
    """Negative log-likelihood of the counts of each stroke."""
    every = [follow_law(p, r, dt)[4] for r in rows]
    return np.array(
        [float(m[a:b].sum()) for m, r in zip(every, rows, strict=True) for a, b, _ in r.strokes]
    )


def _scale(p: Terminal, z: Array) -> Terminal:
    changes = {n: float(getattr(p, n)) * math.exp(v) for n, v in zip(RIGID, z, strict=True)}
    return p._replace(**changes)


def _likeliest(
    p: Terminal, rows: Sequence[Record], dt: float, sizes: Sequence[float] = _SIZES
) -> Terminal:
    """Maximum likelihood of `RIGID` in logarithms, without derivatives: counts are not smooth."""
    from scipy.optimize import minimize

    n = len(RIGID)
    most = np.full(n, _WIDE)
    most[RIGID.index("delay")] = math.log(3.0 * dt / p.delay)

    def cost(z: Array) -> float:
        off = np.clip(z, -_WIDE, most)
        far = float(np.sum((z - off) ** 2))
        return float(_surprises(_scale(p, off), rows, dt).sum()) + 1e4 * far

    best, before = np.zeros(n), math.inf
    for size in sizes:
        simplex = np.vstack([best, best + size * np.eye(n)])
        options = {"initial_simplex": simplex, "adaptive": True, "maxfev": 120 * n, "fatol": 0.02}
        options["xatol"] = 1e-5
        found = minimize(cost, best, method="Nelder-Mead", options=options, callback=halt)
        best = found.x if found.fun < before else best
        before = min(before, float(found.fun))
    return _scale(p, np.clip(best, -_WIDE, most))


# Bristles hold a carriage at rest like a spring (Canudas de Wit et al. 1995), so small efforts and
# the swing move it by micrometres. A laser sees both: a larger share of the swinging mass, a slower
# frequency and a quicker decay. Nudges at rest measure the compliance, which corrects the swing.


_BLOCKS = 12  # of each record: each counts as one witness
_TAPS = 16  # samples after a change of effort in which the platform may do anything
_STEPS = 6  # from the swing as it is seen to that without the give


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


def compliance(p: Terminal, rows: Sequence[Nudged], dt: float) -> Give:
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


def swing_motion(p: Terminal, answer: Answer) -> complex:
    """Motion due to the swing, as a share of what a laser sees without it."""
    w = 2.0 * math.pi * p.frequency
    pull = (w * w + 2j * p.decay * w) / p.push  # V: the effort that pulls as the swing does
    return pull * answer.way * cmath.exp(-1j * w * answer.lag)


def stiff(p: Terminal, give: Give) -> Terminal:
    """The swing of a rigid carriage, from that of a compliant one."""
    seen = p
    for _ in range(_STEPS):
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
    w, heavier = 2.0 * math.pi * p.frequency, 1.0 + p.share * swing_motion(p, give.carriage)
    root = (-p.decay + 1j * cmath.sqrt(w * w * heavier - p.decay * p.decay)) / heavier
    return (
        abs(root) / (2.0 * math.pi),
        -root.real,
        p.share * abs(1.0 + swing_motion(p, give.platform)),
    )


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
