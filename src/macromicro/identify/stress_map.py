"""Strain over temperature at several loads as one map: transformation temperatures by stress.

Each load's heating and cooling branch is read as the temperatures T_q at which a share q of its
stroke is done. By branch these are linear in the load,

    T_q(s) = a_q + b_q s

(Clausius-Clapeyron; K. Otsuka, C. M. Wayman, Shape Memory Materials, section 2.2), with one slope
b for all q or one for each. Both levels, cold and hot, go linearly between neighbouring loads; or
one of them does so, and the stroke to the other saturates, a + b (1 - exp(-s / c)) (D. C. Lagoudas,
Shape Memory Alloys, 2008, section 3.3.1; a hot wire is elastic, strokes may be measured from cold):
of these ways the one that predicts loads left out best is taken. Between the lowest and the highest
load measured the map interpolates; beyond them it extrapolates, and says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.stress_cycles import SHARES, Cycle, pieces

BRANCHES = ("heating", "cooling")
_SATURATING = 3  # loads, for three unknowns


class Way(NamedTuple):
    """How the map is made.

    Attributes
    ----------
    common : bool
        Whether all shares of a branch have one slope.
    saturating : bool
        Whether the stroke saturates with the load.
    from_hot : bool
        Whether it is then measured from the hot level, which goes linearly, and not from the cold.
    """

    common: bool
    saturating: bool
    from_hot: bool = False


class Side(NamedTuple):
    """One branch at all loads.

    Attributes
    ----------
    loads : ndarray, shape (k,)
        Rising.
    low, high : ndarray, shape (k,)
        Levels at these.
    at_zero : ndarray, shape (q,)
        a_q, degC.
    slopes : ndarray, shape (q,)
        b_q, K per unit of load.
    spread : ndarray, shape (q,)
        Standard errors of these slopes, NaN of two loads.
    rms : float
        RMS of the temperatures about their lines, K.
    curve : tuple[float, ...]
        a, b, c of the stroke; empty where it goes linearly.
    from_hot : bool
        Whether the stroke leads from the hot level to the cold one.
    """

    loads: Array
    low: Array
    high: Array
    at_zero: Array
    slopes: Array
    spread: Array
    rms: float
    curve: tuple[float, ...] = ()
    from_hot: bool = False

    def levels(self, load: float) -> tuple[float, float]:
        """Cold and hot level at a load.

        Parameters
        ----------
        load : float
            Unit of the loads.

        Returns
        -------
        low, high : float
            Unit of the output.
        """
        low, high = (_between(load, self.loads, each) for each in (self.low, self.high))
        if not self.curve:
            return low, high
        stroke = _saturated(load, *self.curve)
        return (high - stroke, high) if self.from_hot else (low, low + stroke)

    def temperatures(self, load: float) -> Array:
        """Where the shares are done at a load, degC, rising.

        Parameters
        ----------
        load : float
            Unit of the loads.

        Returns
        -------
        ndarray, shape (q,)
            degC.
        """
        return np.maximum.accumulate(self.at_zero + self.slopes * load)

    def output(self, load: float, t: npt.ArrayLike) -> Array:
        """The output on this branch.

        Parameters
        ----------
        load : float
            Unit of the loads.
        t : array_like, shape (n,)
            Temperatures, degC.

        Returns
        -------
        ndarray, shape (n,)
            Unit of the output.
        """
        low, high = self.levels(load)
        share = np.interp(np.asarray(t, np.float64), self.temperatures(load), SHARES)
        # The first and last hundredth are the levels' own.
        share = (share - SHARES[0]) / (SHARES[-1] - SHARES[0])
        return np.asarray(low + (high - low) * share)


class StressMap(NamedTuple):
    """What `fit` found.

    Attributes
    ----------
    heating, cooling : Side
        The branches.
    way : Way
        How it was made.
    left_out : dict[float, float]
        RMS at each load by a map of the others, as a share of the output's range there.
    inside : tuple[float, ...]
        Loads of these that lie between others.
    cycles : tuple[Cycle, ...]
        What it was fitted to, by rising load.
    """

    heating: Side
    cooling: Side
    way: Way
    left_out: dict[float, float]
    inside: tuple[float, ...]
    cycles: tuple[Cycle, ...]

    def within(self, load: float) -> bool:
        """Whether the map interpolates at a load.

        Parameters
        ----------
        load : float
            Unit of the loads.

        Returns
        -------
        bool
            False: it extrapolates.
        """
        return bool(self.heating.loads[0] <= load <= self.heating.loads[-1])

    def predict(self, load: float, t: npt.ArrayLike) -> Array:
        """The output over a way of whole branches.

        Parameters
        ----------
        load : float
            Unit of the loads.
        t : array_like, shape (n,)
            Temperatures in time order, degC.

        Returns
        -------
        ndarray, shape (n,)
            Unit of the output.
        """
        way = np.asarray(t, np.float64)
        found = np.empty(len(way))
        for start, end, rising in pieces(way):
            side = self.heating if rising else self.cooling
            found[start:end] = side.output(load, way[start:end])
        return found


def _between(load: float, loads: Array, values: Array) -> float:
    """Linear between loads, and beyond the last ones along their line."""
    if len(loads) == 1:
        return float(values[0])
    k = int(np.clip(np.searchsorted(loads, load) - 1, 0, len(loads) - 2))
    part = (load - loads[k]) / (loads[k + 1] - loads[k])
    return float(values[k] + part * (values[k + 1] - values[k]))


def _saturated(load: float, a: float, b: float, c: float) -> float:
    return float(a - b * np.expm1(-load / c))


def _curve(loads: Array, values: Array) -> tuple[float, ...]:
    """a, b and c nearest to the levels: linear in a and b, c by search."""
    from scipy.optimize import minimize_scalar

    def solved(log: float) -> tuple[Array, float]:
        table = np.stack([np.ones_like(loads), -np.expm1(-loads / np.exp(log))], axis=1)
        theta = np.linalg.lstsq(table, values, rcond=None)[0]
        return theta, float(np.sum((values - table @ theta) ** 2))

    size = np.log(np.abs(loads).max())
    found = minimize_scalar(lambda log: solved(log)[1], bounds=(size - 4, size + 3))
    a, b = solved(found.x)[0].tolist()
    return a, b, float(np.exp(found.x))


def _side(cycles: Sequence[Cycle], name: str, way: Way) -> Side:
    """One branch of all loads."""
    own = [getattr(c, name) for c in cycles]
    loads = np.array([c.load for c in cycles])
    table = np.stack([b.temperatures for b in own])
    about = loads - loads.mean()
    slopes = about @ table / (about @ about)
    free = len(loads) - 2
    if way.common:
        slopes = np.full(len(SHARES), slopes.mean())
    at_zero = table.mean(axis=0) - slopes * loads.mean()
    missed = table - at_zero - np.outer(loads, slopes)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = (missed**2).sum(axis=0) / free
        if way.common:  # shares of one load miss together: each load is one witness
            variance = np.full(len(SHARES), variance.mean())
        spread = np.sqrt(variance / (about @ about))
    if free == 0:
        spread = np.full(len(SHARES), np.nan)
    rms = float(np.sqrt(np.mean(missed**2)))
    low, high = (np.array([getattr(b, each) for b in own]) for each in ("low", "high"))
    curve = _curve(loads, high - low) if way.saturating else ()
    return Side(loads, low, high, at_zero, slopes, spread, rms, curve, way.from_hot)


def _map(cycles: Sequence[Cycle], way: Way) -> StressMap:
    heating, cooling = (_side(cycles, name, way) for name in BRANCHES)
    return StressMap(heating, cooling, way, {}, (), tuple(cycles))


def missed(found: StressMap, one: Cycle) -> float:
    """RMS of a map over a record, as a share of the output's range there.

    Parameters
    ----------
    found : StressMap
        The map.
    one : Cycle
        The record.

    Returns
    -------
    float
        From 0.
    """
    error = found.predict(one.load, one.t) - one.y
    return float(np.sqrt(np.mean(error**2)) / np.ptp(one.y))


def fit(cycles: Sequence[Cycle]) -> StressMap:
    """The map of some loads, judged by leaving each of them out.

    Parameters
    ----------
    cycles : Sequence[Cycle]
        Of two different loads or more.

    Returns
    -------
    StressMap
        Made the way that predicts loads between others best, and else with one slope for all
        shares and levels that go linearly.

    Raises
    ------
    InputError
        There are fewer loads.
    """
    ordered = sorted(cycles, key=lambda c: c.load)
    loads = [c.load for c in ordered]
    if len(set(loads)) != len(loads) or len(loads) < 2:
        shown = ", ".join(f"{each:g}" for each in loads)
        raise InputError("loads", shown or "none", "two or more, each once")
    inside = tuple(loads[1:-1])
    strokes = ((False, False), (True, False), (True, True))
    ways = [Way(common, *stroke) for common in (True, False) for stroke in strokes]
    tried = {way: _left_out(ordered, way) for way in ways}

    def score(way: Way) -> float:
        if not inside or not all(each in tried[way] for each in inside):
            return np.inf
        return float(np.mean(np.square([tried[way][each] for each in inside])))

    best = min(ways, key=score)
    return _map(ordered, best)._replace(left_out=tried[best], inside=inside)


def _left_out(cycles: Sequence[Cycle], way: Way) -> dict[float, float]:
    """RMS at each load by a map of the others; empty where these are too few for the way."""
    others = len(cycles) - 1
    least = max(1 + (not way.common), 2, _SATURATING if way.saturating else 2)
    if others < least:
        return {}
    return {
        one.load: missed(_map([*cycles[:k], *cycles[k + 1 :]], way), one)
        for k, one in enumerate(cycles)
    }
