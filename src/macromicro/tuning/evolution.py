"""Differential evolution over the unit cube, a whole generation at a time.

Storn and Price, Differential evolution - a simple and efficient heuristic for global
optimization over continuous spaces, 1997, as in `scipy.optimize`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.sampling import latin

Costs = Callable[[Array], Array]

PER_KNOB = 10
KEPT = 200
FEWEST = 5  # members that differential evolution needs


class Found(NamedTuple):
    design: Array  # the best, from 0 to 1
    cost: float
    evaluations: int  # that were made
    history: tuple[float, ...]  # the least cost after each generation
    ranked: Array  # the best designs tried, best first, `KEPT` at most
    costs: Array  # of these


def members(evaluations: int, knobs: int) -> int:
    """Size of a generation: ten per knob.

    It is smaller if four generations would not fit, and takes all in one as a last resort.
    """
    fewer = min(PER_KNOB * knobs, evaluations // 4)
    return fewer if fewer >= FEWEST else min(max(evaluations // 2, FEWEST), evaluations)


class Stop(Exception):
    """Raised by `progress`: the search ends with the best design so far."""


def minimise(
    costs: Costs,
    start: Array,
    evaluations: int,
    seed: int,
    progress: Callable[[int, float], None] = lambda done, best: None,
) -> Found:
    """Search for the least cost; the first generation is a Latin hypercube."""
    knobs = len(start)
    size = members(evaluations, knobs)
    drawn = latin(knobs, size, seed)
    drawn[0] = start
    history: list[float] = []
    kept = [np.empty((0, knobs)), np.empty(0)]

    def asked(designs: Array) -> Array:
        found = costs(designs)
        every = (np.concatenate((kept[0], designs)), np.concatenate((kept[1], found)))
        order = np.argsort(every[1], kind="stable")[:KEPT]
        kept[:] = [each[order] for each in every]
        history.append(float(kept[1][0]))
        progress(size * len(history), history[-1])
        return found

    generations = evaluations // size
    with contextlib.suppress(Stop):
        if generations < 2 or size < FEWEST:
            asked(drawn)
        else:
            _evolve(asked, drawn, generations, seed)
    return Found(kept[0][0], history[-1], size * len(history), tuple(history), *kept)


def _evolve(asked: Costs, drawn: Array, generations: int, seed: int) -> None:
    from scipy.optimize import differential_evolution

    differential_evolution(
        lambda x: asked(np.ascontiguousarray(x.T)),
        [(0.0, 1.0)] * drawn.shape[1],
        init=drawn,
        maxiter=generations - 1,
        tol=0.0,
        atol=-1.0,  # the budget ends the search, not the population's spread
        mutation=(0.5, 1.0),
        recombination=0.9,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=np.random.default_rng(seed),
    )
