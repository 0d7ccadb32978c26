"""Differential evolution over the unit cube, a whole generation at a time.

Storn and Price, Differential evolution - a simple and efficient heuristic for global
optimization over continuous spaces, 1997, as `scipy.optimize` has it.
"""

from __future__ import annotations

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
    """What a search found.

    Attributes
    ----------
    design : ndarray, shape (k,)
        The best, from 0 to 1.
    cost : float
        Of it.
    evaluations : int
        That were made.
    history : tuple of float
        The least cost after each generation.
    ranked : ndarray, shape (m, k)
        The best designs tried, best first, `KEPT` at most.
    costs : ndarray, shape (m,)
        Of these.
    """

    design: Array
    cost: float
    evaluations: int
    history: tuple[float, ...]
    ranked: Array
    costs: Array


def members(evaluations: int, knobs: int, block: int = 1) -> int:
    """Give the size of a generation: ten for each knob, filled up to whole blocks.

    It is smaller where not even four generations could be had; all in one where that does not help.

    Parameters
    ----------
    evaluations : int
        The budget.
    knobs : int
        Searched quantities.
    block : int
        Designs that are computed together.

    Returns
    -------
    int
        `FEWEST` at least, but for a smaller budget.
    """
    wanted = -(-PER_KNOB * knobs // block) * block
    fewer = min(wanted, evaluations // 4)
    return fewer if fewer >= FEWEST else min(max(evaluations // 2, FEWEST), evaluations)


def minimise(
    costs: Costs,
    start: Array,
    evaluations: int,
    seed: int,
    block: int = 1,
    progress: Callable[[int, float], None] = lambda done, best: None,
) -> Found:
    """Search for the least cost.

    The first generation is a Latin hypercube.

    Parameters
    ----------
    costs : callable
        Takes designs (n, k) within 0 and 1 and gives costs (n,).
    start : ndarray, shape (k,)
        Is tried, too.
    evaluations : int
        At most so many designs.
    seed : int
        Of the search.
    block : int
        Designs that are computed together.
    progress : callable
        Hears evaluations done and the least cost.

    Returns
    -------
    Found
        The best, and those that came near.
    """
    knobs = len(start)
    size = members(evaluations, knobs, block)
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
