"""Hints for a linear record: a delay, a higher order, a dead zone or a limit; and its constant."""

# Each is fitted to the first part of every record and judged by a free simulation of the last part.

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from typing import NamedTuple, cast

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify._linear import Start, free_runs, iterated, prepared
from macromicro.identify.notices import DataWarning

_TRAIN = 0.7  # of each record
_LESS = 0.1  # by which part the error of the last part must be lower
_MOST = 50_000  # samples that are looked at, the first ones of each record
_DELAYS = 50  # samples, at most
_EXACT = 1e-9  # of the output: no more than rounding is left
_FINE = 1e-4  # of the output's range: the search for a constant ends there
_PARTS = np.arange(0.05, 0.96, 0.05)  # of the largest input: dead zones and limits tried


class Asked(NamedTuple):
    # u, y: inputs and outputs, shape (n,) per record
    u: Sequence[Array]
    y: Sequence[Array]
    # na, nb, delay: orders of the model
    na: int
    nb: int
    delay: int
    dt: float  # sample time, s
    start: str = "rest"  # "rest" or "free"


class Hint(NamedTuple):
    lowered: float  # relative reduction of the error
    words: str  # the model, and how to ask for it


def hints(asked: Asked, unit: str = "") -> list[Hint]:
    """Models that predict the last 30 % of the records better by a tenth or more."""
    asked = _short(asked)
    own = _missed(asked)
    if not np.isfinite(own) or own <= _EXACT * _rms(list(asked.y)):
        return []
    found = []
    for tried, words in _others(asked, unit):
        lowered = 1.0 - _missed(tried) / own
        if lowered >= _LESS:
            found.append(Hint(lowered, words))
    return sorted(found, reverse=True)


def _short(asked: Asked) -> Asked:
    most = _MOST // len(asked.u)
    return asked._replace(u=[u[:most] for u in asked.u], y=[y[:most] for y in asked.y])


def _others(asked: Asked, unit: str) -> Iterator[tuple[Asked, str]]:
    """The best of each kind on the first part, in words."""
    na, nb, delay = asked.na, asked.nb, asked.delay
    most = min(_DELAYS, min(len(u) for u in asked.u) // 20)
    late = [asked._replace(delay=k) for k in range(most + 1) if k != delay]
    best = min(late, key=_left)
    yield best, f"a delay of {best.delay} (--order {na},{nb},{best.delay})"
    higher = asked._replace(na=na + 1, nb=nb + 1)
    yield higher, f"an order of {na + 1} (--order {na + 1},{nb + 1},{delay})"
    size = max(float(np.abs(u).max()) for u in asked.u)
    dead = {p * size: _limited(asked, low=p * size) for p in _PARTS}
    width = min(dead, key=lambda at: _left(dead[at]))
    yield dead[width], f"a dead zone of {width:.2g} {unit}".rstrip() + f" (--width {width:.2g})"
    cut = {p * size: _limited(asked, high=p * size) for p in _PARTS}
    limit = min(cut, key=lambda at: _left(cut[at]))
    yield cut[limit], f"an input that acts up to {limit:.2g} {unit} only".replace("  ", " ")


def _limited(asked: Asked, low: float = 0.0, high: float = np.inf) -> Asked:
    """The input beyond a dead zone and within a limit."""
    inputs = [np.sign(u) * np.minimum(np.maximum(np.abs(u) - low, 0.0), high) for u in asked.u]
    return asked._replace(u=inputs)


def constant(asked: Asked) -> float:
    """Constant of the output that lowers the error by a tenth or more, else 0."""
    from scipy.optimize import minimize_scalar

    asked = _short(asked)
    own = _missed(asked)
    if own <= _EXACT * _rms(list(asked.y)):
        return 0.0

    def less(c: float) -> Asked:
        return asked._replace(y=[y - c for y in asked.y])

    rest = float(np.mean([y[0] for y in asked.y]))  # records often begin at rest
    extent = max(float(np.ptp(y)) for y in asked.y)
    found = minimize_scalar(
        lambda c: _left(less(c)),
        bounds=(rest - extent, rest + extent),
        method="bounded",
        options={"xatol": _FINE * extent},
    )
    best = min((rest, float(found.x)), key=lambda c: _left(less(c)))
    return best if _missed(less(best)) <= (1.0 - _LESS) * own else 0.0


def _cut(record: Array) -> int:
    return round(_TRAIN * len(record))


def _errors(asked: Asked) -> list[Array]:
    """Errors over whole records by `mls` of their first parts; none if it fails."""
    u, y = ([part[: _cut(part)] for part in each] for each in (asked.u, asked.y))
    how = asked.na, asked.nb, asked.dt, asked.delay
    start = cast(Start, asked.start)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)  # they are about an input that was cut here
        try:
            theta = iterated(prepared(u, y, *how, start=start), instruments=False).theta
            whole = prepared(asked.u, asked.y, *how, start=start)
        except InputError:
            return []
    with np.errstate(over="ignore", invalid="ignore"):
        return [b - run for b, run in zip(asked.y, free_runs(whole, theta), strict=True)]


def _rms(errors: list[Array]) -> float:
    every = np.concatenate(errors) if errors else np.full(1, np.inf)
    with np.errstate(over="ignore", invalid="ignore"):
        found = float(np.sqrt(np.mean(every**2)))
    return found if np.isfinite(found) else float("inf")


def _left(asked: Asked) -> float:
    return _rms([e[: _cut(e)] for e in _errors(asked)])


def _missed(asked: Asked) -> float:
    return _rms([e[_cut(e) :] for e in _errors(asked)])
