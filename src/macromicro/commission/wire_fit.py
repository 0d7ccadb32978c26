"""A wire's heat and contraction fitted to a slow ramp and to pulses."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission.stand import CommissionError, Record
from macromicro.commission.wire_model import Heat, simulated, thinned

# Standard deviation of what the model leaves out (what is around the wire warms in more than one
# step, a bend that is not that of f), as a part of the value: seen on 12 random wires of
# docs/commissioning_wire.py, and checked on others there.
_LEFT_OUT = {"up": 0.06, "tau": 0.12, "start": 0.05, "end": 0.05, "first": 0.05, "last": 0.05}
_BENT = 0.3  # to begin with
_SHARES, _SLOWER = (0.03, 0.25), (3.0, 12.0)  # of what is around the wire, to begin with


class Wire(NamedTuple):
    """What the records show.

    Attributes
    ----------
    heat : Heat
        The parameters.
    covariance : ndarray, shape (11, 11)
        Of them, a rise or fall of the effort a witness.
    freedom : float
        Witnesses less one.
    rms : float
        What is left, m.
    """

    heat: Heat
    covariance: Array
    freedom: float
    rms: float

    def deviation(self, name: str) -> float:
        """Standard deviation of a quantity, with what the model leaves out.

        Parameters
        ----------
        name : str
            A field of `Heat`, or "up".

        Returns
        -------
        float
            In its unit.
        """
        if name == "up":
            value, slope = self.up, _up_slope(self.heat)
            square = float(slope @ self.covariance @ slope)
        else:
            k = Heat._fields.index(name)
            value, square = self.heat[k], float(self.covariance[k, k])
        return math.hypot(math.sqrt(max(square, 0.0)), _LEFT_OUT.get(name, 0.0) * value)

    @property
    def up(self) -> float:
        """Speed of contraction per effort, m/(V s)."""
        return _up(self.heat)

    @property
    def down(self) -> float:
        """Speed of extension per heat, m/(V s)."""
        p = self.heat
        return p.way / (p.tau * (p.first - p.last) + p.latent)


def _up(p: Heat) -> float:
    return p.way * (1.0 - p.share) / (p.tau * (p.end - p.start) + p.latent)


def _up_slope(p: Heat) -> Array:
    """How `_up` changes with each parameter."""
    steps = {n: 1e-6 * max(abs(v), 1e-3) for n, v in p._asdict().items()}
    near = {n: p._replace(**{n: getattr(p, n) + step}) for n, step in steps.items()}
    return np.array([(_up(near[n]) - _up(p)) / step for n, step in steps.items()])


def fitted(records: Sequence[Record], dt: float, way: float, noise: float) -> Wire:
    """Parameters whose free runs from cold are nearest to the records.

    Parameters
    ----------
    records : Sequence[Record]
        The slow ramp first, then pulses.
    dt : float
        Control period, s.
    way : float
        Full contraction as the ramp showed it, m.
    noise : float
        Of the reading, m.

    Returns
    -------
    Wire
        With the covariance of the parameters.

    Raises
    ------
    CommissionError
        No wire explains them.
    """
    from scipy.optimize import least_squares

    thin = [thinned(one, dt) for one in records]
    start = begun(thin[0], thin[1], way)

    def heat(p: Array) -> Heat:
        v, bends = np.exp(p[:-2]), p[-2:]
        # Differences keep the four in their order.
        share = v[1] / (1.0 + v[1])
        return Heat(v[0], share, v[2], v[3], v[4], v[4] + v[5], v[6] + v[7], v[6], way, *bends)

    def missed(p: Array) -> Array:
        return np.concatenate([(one.x - simulated(heat(p), one)) / way for one in thin])

    best = None
    for share, slow in product(_SHARES, _SLOWER):
        guess = [
            start.tau, share, slow * start.tau, start.latent, start.start,
            start.end - start.start, start.last, start.first - start.last,
        ]  # fmt: skip
        found = least_squares(
            missed, [*np.log(guess), _BENT, _BENT], x_scale=0.1, diff_step=1e-3, max_nfev=40
        )
        if best is None or found.cost < best.cost:
            best = found
    assert best is not None
    p = Heat(*(float(v) for v in heat(best.x)))
    if math.sqrt(np.mean(best.fun**2)) > 0.15:
        raise CommissionError(
            "no heat that comes and goes explains what the wire does: is something in its way, or "
            "does the air move?"
        )
    slopes = _slopes(heat, best.x)
    bread = np.linalg.pinv(best.jac.T @ best.jac, hermitian=True)
    cuts = _turns(thin)
    parts = zip(np.split(best.jac, cuts), np.split(best.fun, cuts), strict=True)
    scores = np.stack([j.T @ e for j, e in parts])
    n = len(scores)
    covariance = slopes @ (n / (n - 1) * bread @ (scores.T @ scores) @ bread) @ slopes.T
    k = Heat._fields.index("way")
    covariance[k, k] = 2.0 * noise**2
    return Wire(p, covariance, n - 1.0, way * float(np.sqrt(np.mean(best.fun**2))))


def begun(ramp: Record, pulses: Record, way: float) -> Heat:
    """Where the search begins: by delays and durations, as if nothing around the wire warmed.

    Parameters
    ----------
    ramp : Record
        Effort that rises steadily.
    pulses : Record
        Of which the first one is looked at.
    way : float
        Full contraction, m.

    Returns
    -------
    Heat
        Roughly.
    """
    from scipy.optimize import brentq

    rate = float(ramp.u[-1] / ramp.t[-1])
    begin, end = (float(ramp.u[int(np.argmax(ramp.x >= s * way))]) for s in (0.01, 0.97))
    off = int(np.argmax((pulses.u <= 0.0) & (pulses.x > 0.5 * way)))
    push, hold = float(pulses.u[3]), float(pulses.u[off - 2])
    t, x = pulses.t, pulses.x

    def when(hit: npt.NDArray[np.bool_], after: int = 0) -> float:
        return float(t[after + int(np.argmax(hit[after:]))])

    wait = max(when(x >= 0.01 * way), float(t[1]))
    heated = max(when(x >= 0.95 * way) - wait, float(t[1]))
    fall = max(when(x <= 0.97 * way, off) - t[off], float(t[1]))
    fallen = max(when(x <= 0.03 * way, off) - t[off] - fall, float(t[1]))

    def early(tau: float) -> float:  # pulse and ramp begin to contract at one heat
        ramped = begin - tau * rate * (1.0 - math.exp(-begin / (tau * rate)))
        return push * (1.0 - math.exp(-wait / tau)) - ramped

    low, high = 0.05 * wait, 50.0 * wait
    tau = float(brentq(early, low, high)) if early(low) * early(high) < 0.0 else 0.7 * wait
    start = push * (1.0 - math.exp(-wait / tau))
    span = max(end - start, 0.05 * start)
    both = heated * max(push - start - 0.5 * span, 0.05 * push)
    root = (end - start) ** 2 - 4.0 * rate * both
    width = 0.5 * (end - start + math.sqrt(root)) if root > 0.0 else 0.5 * span
    latent = max(both - tau * width, 0.1 * both)
    first = hold * math.exp(-fall / tau)
    cold = (first * fallen - latent) / (tau + 0.5 * fallen)
    cold = min(max(cold, 0.1 * first), 0.8 * first)
    return Heat(tau, 0.0, tau, latent, start, start + width, first, first - cold, way)


def _slopes(heat: Callable[[Array], Heat], at: Array) -> Array:
    """How the parameters change with those that are searched."""
    columns = []
    for k in range(len(at)):
        there = at.copy()
        there[k] += 1e-5
        columns.append((np.array(heat(there)) - np.array(heat(at))) / 1e-5)
    return np.stack(columns, axis=1)


def _turns(records: Sequence[Record]) -> Array:
    """Rows at which the effort begins to heat or to cool."""
    cuts, done = [], 0
    for one in records:
        steps = np.flatnonzero(np.abs(np.diff(one.u)) > 0.05 * np.ptp(one.u)) + 1
        kept = steps[np.diff(steps, prepend=-10) > 5]
        cuts += [done + int(k) for k in kept if k > 5]
        done += len(one.u)
        cuts.append(done)
    return np.array(cuts[:-1])
