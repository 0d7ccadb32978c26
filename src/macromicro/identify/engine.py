"""Output error over pieces of records, and the choice between models by pieces held out.

Over a whole record disturbing forces accumulate like a random walk; in pieces a longer record
gives a better estimate. Each piece has its own initial state, which is eliminated: residuals and
slopes are projected onto what the state cannot explain (variable projection, G. Golub, V.
Pereyra, SIAM J. Numerical Analysis 10, 1973, with L. Kaufman's slopes, BIT 15, 1975).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.search import NUDGE, central, least_squares

Index = npt.NDArray[np.int64]
_LEAST = 1e-2  # of a parameter's scale: differences are never finer
_STATE = 1e-4  # of the states' scales: over which their slopes are taken
_BLIND = 1e-9  # of the output's scale, by a state's: it shows nowhere
_ALONE = 1e-10  # of the power of a state's slope: it is like that of the other one
_PARTS = (1.0, 0.5, 0.2)  # of a step of the states that are tried
_ROUNDS = 4  # of states
_NEAR, _NEARER = 1e-4, 1e-10  # part of the cost by which a search, or a round, may still lower it
_EXACT = 1e-21  # mean square of what is missed, in the output's scale: rounding
_LONG = 10_000  # samples: a simulation takes longer than to start threads
_ENDED = 1e-4  # of a parameter's scale: as good as none


class Pieces(NamedTuple):
    """Parts of records with the states that their simulations begin from; k pieces."""

    force: Array  # of all pieces, each behind samples whose force may act late
    first: Index  # of each piece, (k,), in `force`
    many: Index  # samples in each, (k,)
    dt: Array  # s, (k,)
    x: Array  # place at the first sample, (k,)
    v: Array  # speed at the first sample, (k,)
    y: Array  # measured output, (n,)

    @property
    def edges(self) -> Index:
        return np.concatenate([[0], np.cumsum(self.many)])

    def some(self, kept: npt.NDArray[np.bool_]) -> Pieces:
        first, many = self.first[kept], self.many[kept]
        dt, x, v = (each[kept] for each in (self.dt, self.x, self.v))
        return Pieces(self.force, first, many, dt, x, v, self.y[np.repeat(kept, self.many)])

    def totals(self, values: Array) -> Array:
        return np.asarray(np.add.reduceat(values, self.edges[:-1]))

    def spread(self, values: Array) -> Array:
        return np.repeat(values, self.many)


class Space(NamedTuple):
    """What the parameters of a search may be; arrays of shape (p,)."""

    names: tuple[str, ...]
    scale: Array
    low: Array  # in parts of the scale
    high: Array
    states: tuple[float, float]  # scales of place and speed
    unit: float  # scale of the output


Simulated = Callable[[Array, Pieces], Array]  # outputs of the pieces by the parameters' values


class Fit(NamedTuple):
    """The end of a search; slopes and residuals without what initial states explain."""

    values: Array  # of the parameters
    slopes: Array  # of the simulation by these, (n, p)
    residual: Array  # simulated less measured, (n,)
    pieces: Pieces  # with their states as found
    settled: bool
    bound: npt.NDArray[np.bool_]  # parameters that ended at a bound
    space: Space

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.residual**2)))


def fit(
    simulated: Simulated,
    space: Space,
    pieces: Pieces,
    begin: Array,
    *,
    most: int = 60,
    rounds: int = _ROUNDS,
) -> Fit:
    """The minimum next to a starting point, with the states of the pieces."""
    at = begin / space.scale
    least = np.inf
    for k in range(rounds):
        search = _Search(simulated, space, pieces)
        found = least_squares(
            search.missed,
            np.clip(at, space.low + 1e-9, space.high - 1e-9),
            search.slopes,
            bounds=(space.low, space.high),
            xtol=1e-9,
            ftol=_NEARER if k else _NEAR,
            gtol=1e-15,
            x_scale="jac",
            max_nfev=most,
        )
        at, cost = found.x, float(found.cost)
        last = (k and cost >= least * (1.0 - _NEARER)) or cost < _EXACT * len(pieces.y)
        if last or found.status == 0 or k + 1 == rounds:
            break
        least, pieces = cost, search.moved(at)
    ended = (space.low >= 0.0) & (at - space.low < _ENDED)
    at = np.where(ended & (space.low == 0.0), 0.0, at)
    slopes = found.jac * space.unit / space.scale
    settled = bool(found.status != 0)
    return Fit(at * space.scale, slopes, found.fun * space.unit, pieces, settled, ended, space)


def without_starts(simulated: Simulated, end: Fit, change: Array) -> Array:
    """A change of the outputs at the end of a search less what initial states explain."""
    search = _Search(simulated, end.space, end.pieces)
    search.missed(end.values / end.space.scale)
    return search.less(change)


def residual(simulated: Simulated, space: Space, pieces: Pieces, values: Array) -> Array:
    """Residuals of pieces by known parameters, the states of the pieces found."""
    near = settle_starts(simulated, space, pieces, values, 1)
    return np.asarray(_Search(simulated, space, near).missed(values / space.scale) * space.unit)


def settle_starts(
    simulated: Simulated, space: Space, pieces: Pieces, values: Array, rounds: int = _ROUNDS
) -> Pieces:
    """The pieces from states that are nearer to their records."""
    for _ in range(rounds):
        pieces = _Search(simulated, space, pieces).moved(values / space.scale)
    return pieces


@contextmanager
def _side_by_side(samples: int) -> Iterator[Callable[..., Iterable[Array]]]:
    """`map`, or for long simulations the same in threads: compiled, they release the lock."""
    if samples < _LONG:
        yield map
        return
    with ThreadPoolExecutor() as pool:
        yield pool.map


class _Search:
    """Residuals and slopes of pieces from fixed states, and the states that are nearer."""

    def __init__(self, simulated: Simulated, space: Space, pieces: Pieces) -> None:
        self.simulated, self.space, self.pieces = simulated, space, pieces
        self._at: bytes | None = None
        self._plain = np.empty(0)
        self._units: list[Array] = []  # orthonormal changes by the states, in each piece
        self._size: list[Array] = []
        self._shared = np.empty(0)

    def missed(self, at: Array) -> Array:
        self._prepare(at)
        left = self.less(self._plain - self.pieces.y) / self.space.unit
        return np.nan_to_num(left, nan=1e6, posinf=1e6, neginf=-1e6)

    def slopes(self, at: Array) -> Array:
        self._prepare(at)
        # Steps are wide enough to smooth over samples at which a mass sticks.
        nudge = NUDGE * np.maximum(np.abs(at), _LEAST)
        low, high = self.space.low, self.space.high
        made = partial(self._run, pieces=self.pieces)
        with _side_by_side(len(self.pieces.y)) as mapped:
            table = central(made, at, nudge, low, high, self.less, mapped)
        return np.nan_to_num(table / self.space.unit)

    def moved(self, at: Array) -> Pieces:
        """The pieces from nearer states, each where that is so."""
        self._prepare(at)
        pieces, error = self.pieces, self._plain - self.pieces.y
        speed, place = (pieces.totals(unit * error) for unit in self._units)
        by_place = -place * self._size[1]
        by_speed = -(speed + self._shared * by_place) * self._size[0]
        x, v, least = pieces.x, pieces.v, pieces.totals(error * error)
        for part in _PARTS:
            there = pieces._replace(x=pieces.x + part * by_place, v=pieces.v + part * by_speed)
            now = self._run(at, there) - pieces.y
            square = pieces.totals(now * now)
            better = square < least
            x, v = np.where(better, there.x, x), np.where(better, there.v, v)
            least = np.where(better, square, least)
        return pieces._replace(x=x, v=v)

    def _run(self, at: Array, pieces: Pieces) -> Array:
        return self.simulated(at * self.space.scale, pieces)

    def _prepare(self, at: Array) -> None:
        """Simulations at these parameters, and orthonormal changes by the states."""
        if self._at == at.tobytes():
            return
        pieces, unit = self.pieces, self.space.unit
        place, rate = self.space.states
        faster, further = _STATE * rate, _STATE * place
        beside = pieces._replace(v=pieces.v + faster), pieces._replace(x=pieces.x + further)
        with _side_by_side(len(pieces.y)) as mapped:
            self._plain, *moved = mapped(partial(self._run, at), (pieces, *beside))
        by_speed = (moved[0] - self._plain) / faster
        by_place = (moved[1] - self._plain) / further
        one, size = self._normal(np.nan_to_num(by_speed), _BLIND * unit / rate)
        self._shared = pieces.totals(one * by_place)
        across = np.nan_to_num(by_place) - one * pieces.spread(self._shared)
        least = _ALONE * pieces.totals(by_place**2) ** 0.5 + _BLIND * unit / place
        other, other_size = self._normal(across, least)
        self._units, self._size = [one, other], [size, other_size]
        self._at = at.tobytes()

    def _normal(self, change: Array, least: float | Array) -> tuple[Array, Array]:
        """A change scaled to length one in each piece, 0 where it is none, and what scaled it."""
        length = np.sqrt(self.pieces.totals(change * change))
        shown = length > least
        size = np.where(shown, 1.0 / np.where(shown, length, 1.0), 0.0)
        return change * self.pieces.spread(size), size

    def less(self, values: Array) -> Array:
        """Values less what the states explain."""
        values = np.nan_to_num(values, nan=1e100, posinf=1e100, neginf=-1e100)
        for unit in self._units:
            values = values - unit * self.pieces.spread(self.pieces.totals(unit * values))
        return values


# A richer model has to predict the pieces held out in turn better by a share, and by more than they
# scatter.

FOLDS = 3
GAIN = 0.02  # a richer model must lower the held-out error by this part
_SURE = 2.0  # and the pieces' squares by so many standard errors of what they gain
_SEARCH = 15  # steps of a search without the pieces held out


class Judged(NamedTuple):
    structure: str  # the chosen one
    # RMS error of each in a typical held-out piece: the geometric mean of all
    scores: dict[str, float]
    reasons: dict[str, str]  # why each other one was not chosen, in words


def turn(number: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Turn in which each piece is held out."""
    # Every third piece, a different one of each three: a motion with a period of three pieces would
    # otherwise be held out in the same phase each time.
    return (number + number // FOLDS) % FOLDS


def typical(squares: Array) -> float:
    # A plain mean would be that of the one piece in which the mass sticks.
    return float(np.exp(0.5 * np.mean(np.log(squares))))


def no_better(score: float, richer: float, gained: Array, than: str, sure: float = _SURE) -> str:
    """Why a richer model is not taken; empty if it is."""
    if richer >= (1.0 - GAIN) * score:
        return f"not {100.0 * GAIN:.0f} % better than {than}"
    error = float(np.std(gained, ddof=1) / np.sqrt(len(gained))) if len(gained) > 1 else 0.0
    if float(gained.mean()) < sure * error:
        return f"better than {than}, but by less than the scatter of the blocks"
    return ""


def simplest(squares: dict[str, Array], reasons: dict[str, str] | None = None) -> Judged:
    """The simplest model, of those from poor to rich, that no richer one beats."""
    scores = {name: typical(each) for name, each in squares.items()}
    against = dict(reasons or {})
    best = ""
    for name, score in scores.items():
        if not best:
            best = name
            continue
        gained = np.log(squares[best] / squares[name])
        why = no_better(scores[best], score, gained, best)
        if why:
            against[name] = why
        else:
            against[best] = f"{name} is better"
            best = name
    return Judged(best, scores, against)


def held_out(
    simulated: Simulated, space: Space, pieces: Pieces, begin: Array, measured: Pieces | None = None
) -> Array:
    """Mean square error of each piece by a fit without it, from its own state or a measured one."""
    turns = turn(np.arange(len(pieces.many)))
    squares = np.empty(len(turns))
    for fold in range(min(FOLDS, len(turns))):
        held = turns == fold
        kept = pieces if held.all() else pieces.some(~held)
        found = fit(simulated, space, kept, begin, most=_SEARCH, rounds=1)
        if measured is None:
            other = pieces.some(held)
            error = residual(simulated, space, other, found.values)
        else:
            other = measured.some(held)
            error = simulated(found.values, other) - other.y
        squares[held] = other.totals(error**2) / other.many
    return np.asarray(squares + 1e-30 * space.unit**2)
