"""A carriage for terminal control: drive, friction and delay from whole counts, swing from a laser.

Over strokes from rest to rest the law's own estimator says how probable each count is, given
those before; the parameters are those that make all counts likeliest (prediction error method by
maximum likelihood: Ljung, System Identification, 1999, Chapter 7) and, where a laser saw the
platform come to rest, its readings of the swing. So friction that changes along the rod, which
the estimator follows, is no error of the model. Standard errors take each stroke as one
observation (a "sandwich" over strokes: Liang and Zeger, 1986).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.terminal import estimate, model
from macromicro.control.terminal.estimate import Belief
from macromicro.control.terminal.model import Motion, Terminal
from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel

RIGID = ("push", "drag", "coulomb", "breakaway", "fade", "delay", "unknown")
SWING = ("frequency", "decay", "share")
FEWEST = 4  # strokes
_BEFORE = 0.02  # s at rest before a stroke
_AFTER = 0.03  # s after the last count until the laser sees the swing alone
_SEEN = 0.25  # s of it at least
_ROOT2 = math.sqrt(2.0)
_ODD = 1e3  # of so many counts one may be anything near
_SPAN = 2e-3  # of logarithms, for slopes and curvatures


class Record(NamedTuple):
    """Strokes in open loop, from rest to rest.

    Attributes
    ----------
    u : ndarray, shape (n,)
        Efforts sent, V.
    counts : ndarray, shape (n,)
        Of the encoder.
    laser : ndarray, shape (n,)
        Platform, m; empty: not measured.
    strokes : tuple[tuple[int, int, int], ...]
        Of each: its rows [a, b), and the row from which the laser shows the swing alone (b:
        nowhere).
    """

    u: Array
    counts: Array
    laser: Array
    strokes: tuple[tuple[int, int, int], ...]


class CarriageFit(NamedTuple):
    """What `carriage` found.

    Attributes
    ----------
    model : Terminal
        The law's parameters; those that a recording does not tell keep their defaults.
    std : dict[str, float]
        Standard errors of those that were fitted, in their units.
    surprise : float
        Of a count: mean of minus the logarithm of its probability given those before.
    swing_rms : float
        Of the swing by the laser, m; NaN without one.
    records : tuple[Record, ...]
        What was fitted to.
    motion : tuple[Array, ...]
        Of each record by the law's estimator, as `followed` gives it.
    dt : float
        Sample time, s.
    """

    model: Terminal
    std: dict[str, float]
    surprise: float
    swing_rms: float
    records: tuple[Record, ...]
    motion: tuple[Array, ...]
    dt: float


@kernel
def _log_probability(p: Terminal, b: Belief, reading: float) -> float:
    """Logarithm of the probability that a count is read, from the belief before it.

    One in `_ODD` counts may be anything near: one that flickers at an edge says nothing.
    """
    deviation = math.sqrt(max(b.spread.xx, 1e-4 * p.pitch * p.pitch))
    low, high = reading - b.motion.x, reading + p.pitch - b.motion.x
    inside = 0.5 * (math.erf(high / deviation / _ROOT2) - math.erf(low / deviation / _ROOT2))
    beyond = max(low, -high, 0.0) / p.pitch
    return math.log(max(inside, 0.0) + math.exp(-beyond) / _ODD)


@kernel
def _follow(p: Terminal, u: Array, counts: Array, out: Array, dt: float) -> None:
    """The law's estimator over a record: place, speed, swing, friction, log-probability."""
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


def followed(p: Terminal, r: Record, dt: float) -> Array:
    """The law's estimator over a record.

    Parameters
    ----------
    p : Terminal
        The law's model.
    r : Record
        The record.
    dt : float
        Sample time, s.

    Returns
    -------
    ndarray, shape (5, n)
        Place (m), speed (m/s), deflection of the swing (m), excess friction (V), and minus the
        logarithm of the probability of each count, given those before.
    """
    out = np.empty((5, len(r.u)))
    compiled(_follow)(p, r.u, r.counts, out, dt)
    return out


def cut(t: Array, u: Array, counts: Array, laser: Array | None = None) -> Record:
    """A record with its strokes: each from an effort after rest to the next one.

    Parameters
    ----------
    t : ndarray, shape (n,)
        s, even.
    u : ndarray, shape (n,)
        V.
    counts : ndarray, shape (n,)
        Of the encoder.
    laser : ndarray, shape (n,) or None
        m.

    Returns
    -------
    Record
        Its strokes moved by a count or more, and stood still before.
    """
    dt = float(t[1] - t[0])
    rest = max(round(_BEFORE / dt), 1)
    moving = (u != 0.0) | (np.diff(counts, prepend=counts[0]) != 0.0)
    busy = np.convolve(moving, np.ones(rest), "full")[: len(u)]  # of the last `rest` rows
    quiet = np.concatenate([[True], busy[:-1] == 0.0])
    begins = np.flatnonzero((u != 0.0) & quiet)
    found = []
    for a, b in zip(map(int, begins), [*map(int, begins[1:]), len(u)], strict=True):
        changes = np.flatnonzero(np.diff(counts[a:b]))
        if not len(changes):
            continue
        ends = max(int(changes[-1]) + 1, int(np.flatnonzero(u[a:b])[-1]) + 1)
        still = a + ends + round(_AFTER / dt)
        if laser is None or (b - still) * dt < _SEEN:
            still = b
        found.append((a, b, still))
    y = np.empty(0) if laser is None else np.ascontiguousarray(laser, dtype=np.float64)
    whole = (np.ascontiguousarray(c, dtype=np.float64) for c in (u, counts))
    return Record(*whole, y, tuple(found))


def carriage(records: Sequence[Any], pitch: float) -> CarriageFit:
    """The law's model from strokes in open loop.

    Parameters
    ----------
    records : Sequence
        One or more of (t, u, counts) or (t, u, counts, laser): s, V, counts, m; even samples of
        one sample time.
    pitch : float
        Travel per count, m.

    Returns
    -------
    CarriageFit
        Parameters and their standard errors.

    Raises
    ------
    InputError
        Too few strokes, or they do not tell the parameters.
    """
    dt = float(records[0][0][1] - records[0][0][0])
    rows = [cut(*r) for r in records]
    ways = [r.counts[b - 1] - r.counts[a] for r in rows for a, b, _ in r.strokes]
    if len(ways) < FEWEST:
        accepted = f"{FEWEST} strokes or more, each after {_BEFORE:g} s at rest without effort"
        raise InputError("recordings", f"{len(ways)} strokes", accepted)
    if not (min(ways) < 0.0 < max(ways)):
        raise InputError("recordings", "strokes in one direction", "strokes both ways")
    p = _free(_guess(rows, dt, pitch), rows, dt)
    p = _best(p, RIGID, rows, dt)
    names = RIGID
    if any(still < b for r in rows for _, b, still in r.strokes):
        names = (*RIGID, *SWING)
        p = _best(_swinging(p, rows, dt), SWING, rows, dt)
        p = _best(p, names, rows, dt)
    every = [followed(p, r, dt) for r in rows]
    seen = np.concatenate(
        [y for r, m in zip(rows, every, strict=True) for y in _swings(p, r, m[2])]
    )
    return CarriageFit(
        p,
        _errors(p, names, rows, dt),
        float(np.mean(np.concatenate([m[4] for m in every]))),
        float(np.sqrt(np.mean(seen**2))) if len(seen) else math.nan,
        tuple(rows),
        tuple(every),
        dt,
    )


def _guess(rows: Sequence[Record], dt: float, pitch: float) -> Terminal:
    """Where the search begins: orders of magnitude from the strokes."""
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
    )


@kernel
def _run(p: Terminal, u: Array, out: Array, dt: float) -> None:
    """Place of the model from rest under efforts, without looking at counts."""
    late = int(p.delay / dt)
    part = p.delay - late * dt
    m = Motion(0.0, 0.0, 0.0, 0.0)
    for k in range(len(u)):
        out[k] = m.x
        m = model.moved(p, m, 0.0, u[k - late - 1] if k > late else 0.0, part)
        m = model.moved(p, m, 0.0, u[k - late] if k >= late else 0.0, dt - part)


def _free(p: Terminal, rows: Sequence[Record], dt: float) -> Terminal:
    """Acceleration, drag and friction whose free runs are nearest: near enough to begin at."""
    from scipy.optimize import least_squares

    at = np.array([p.push, p.drag, p.coulomb])

    def left(z: Array) -> Array:
        push, drag, coulomb = map(float, at * np.exp(z))
        trial = p._replace(push=push, drag=drag, coulomb=coulomb, breakaway=0.0)
        found = []
        for r in rows:
            for a, b, _ in r.strokes:
                x = np.empty(b - a)
                compiled(_run)(trial, r.u[a:b], x, dt)
                found.append(r.counts[a:b] - r.counts[a] - x / p.pitch)
        return np.concatenate(found)

    found = least_squares(left, np.zeros(3), loss="soft_l1", diff_step=1e-4, x_scale=0.1)
    push, drag, coulomb = map(float, at * np.exp(found.x))
    return p._replace(push=push, drag=drag, coulomb=coulomb, breakaway=0.1 * coulomb)


def _swings(p: Terminal, r: Record, q: Array) -> list[Array]:
    """Laser less swing while the carriage stands after each stroke, m."""
    found = []
    for _, b, still in r.strokes:
        off = r.laser[still:b] - p.share * q[still:b] if still < b else np.empty(0)
        if len(off):
            k = np.linspace(-1.0, 1.0, len(off))
            off = off - off.mean() - k * float(k @ off / (k @ k))  # level and drift of the laser
        found.append(off)
    return found


def _swinging(p: Terminal, rows: Sequence[Record], dt: float) -> Terminal:
    """Frequency and share by the laser alone: the best of a grid of frequencies."""
    shortest = min((b - still) * dt for r in rows for _, b, still in r.strokes if still < b)
    best, chosen = math.inf, p
    for f in np.arange(2.0 / shortest, 0.2 / dt, 0.25 / shortest):
        trial = p._replace(frequency=float(f), decay=1.0, share=1.0)
        swung = [followed(trial, r, dt)[2] for r in rows]
        none = [np.zeros(len(q)) for q in swung]
        y, z = (
            np.concatenate(
                [o for r, q in zip(rows, every, strict=True) for o in _swings(trial, r, q)]
            )
            for every in (none, swung)
        )
        z = y - z  # the swing, as `_swings` sees it
        share = min(max(float(z @ y / max(z @ z, 1e-30)), 1e-4), 1.0)
        left = float(np.sum((y - share * z) ** 2))
        if left < best:
            best, chosen = left, trial._replace(share=share)
    return chosen


def _misfits(p: Terminal, rows: Sequence[Record], dt: float, noise: float) -> Array:
    """Of each stroke: minus the logarithm of the probability of what was seen, but constants."""
    found = []
    for r in rows:
        m = followed(p, r, dt)
        for (a, b, _), y in zip(r.strokes, _swings(p, r, m[2]), strict=True):
            found.append(float(np.sum(m[4, a:b])) + 0.5 * float(np.sum((y / noise) ** 2)))
    return np.array(found)


def _noise(p: Terminal, rows: Sequence[Record], dt: float) -> float:
    """What the laser shows beside the swing, m."""
    every = np.concatenate([y for r in rows for y in _swings(p, r, followed(p, r, dt)[2])])
    return max(float(np.sqrt(np.mean(every**2))), 1e-9) if len(every) else 1.0


def _scaled(p: Terminal, names: Sequence[str], z: Array) -> Terminal:
    changes = {n: float(getattr(p, n)) * math.exp(v) for n, v in zip(names, z, strict=True)}
    return p._replace(**changes)


def _best(p: Terminal, names: Sequence[str], rows: Sequence[Record], dt: float) -> Terminal:
    """The likeliest parameters, on the scale of their logarithms."""
    from scipy.optimize import minimize

    most = {"delay": math.log(3.0 * dt / p.delay), "frequency": 0.05}
    bounds = [(-min(most.get(n, 3.0), 3.0) - 1e-9, most.get(n, 3.0) + 1e-9) for n in names]
    if "delay" in names:
        bounds[names.index("delay")] = (-3.0, max(most["delay"], 1e-9))
    if "share" in names:
        bounds[names.index("share")] = (-3.0, max(-math.log(p.share), 1e-9))

    def cost(z: Array) -> float:
        q = _scaled(p, names, z)  # the laser's noise is whatever makes the rest likeliest
        seen = [(followed(q, r, dt), r) for r in rows]
        left = np.concatenate([y for m, r in seen for y in _swings(q, r, m[2])])
        total = float(sum(m[4].sum() for m, _ in seen))
        return total + (0.5 * len(left) * math.log(float(np.mean(left**2))) if len(left) else 0.0)

    def slope(z: Array) -> Array:
        steps = _SPAN * np.eye(len(names))
        return np.array([(cost(z + s) - cost(z - s)) / (2.0 * _SPAN) for s in steps])

    found = minimize(cost, np.zeros(len(names)), jac=slope, method="L-BFGS-B", bounds=bounds)
    return _scaled(p, names, found.x)


def _errors(
    p: Terminal, names: Sequence[str], rows: Sequence[Record], dt: float
) -> dict[str, float]:
    """Standard errors with each stroke as one observation."""
    noise, k, n = _noise(p, rows, dt), len(names), sum(len(r.strokes) for r in rows)

    def misfits(z: Array) -> Array:
        return _misfits(_scaled(p, names, z), rows, dt, noise)

    steps = _SPAN * np.eye(k)
    scores = np.array([(misfits(s) - misfits(-s)) / (2.0 * _SPAN) for s in steps])
    curved = np.empty((k, k))
    for i in range(k):
        for j in range(i + 1):
            a, b = steps[i], steps[j]
            mixed = [misfits(x).sum() for x in (a + b, a - b, b - a, -a - b)]
            curved[i, j] = curved[j, i] = (mixed[0] - mixed[1] - mixed[2] + mixed[3]) / (
                4.0 * _SPAN * _SPAN
            )
    try:
        inverse = np.linalg.inv(curved)
    except np.linalg.LinAlgError:
        return dict.fromkeys(names, math.nan)
    spread = inverse @ (scores @ scores.T * n / max(n - k, 1)) @ inverse
    known = np.diag(spread) > 0.0
    return {
        name: float(getattr(p, name)) * math.sqrt(spread[i, i]) if known[i] else math.nan
        for i, name in enumerate(names)
    }
