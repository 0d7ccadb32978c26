"""How sure inverse dynamics is of an axis' parameters where a force repeats along its way.

Cogging is no noise: how quickly it changes goes with the speed, and an autoregression of what is
left knows a mean of that. Where most of what is left is one harmonic of the place (`ripple`), it is
drawn in any phase, and what it leaves is taken for noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.axis_inverse import Rows, evened, stacked
from macromicro.identify.coverage import Drawn, normal
from macromicro.identify.ripple import Ripple, ripple
from macromicro.identify.spread import robust_covariance

_PHASES = 200


class Repeating(NamedTuple):
    """A force that repeats along the way, and what else there is.

    Attributes
    ----------
    force : Ripple
        The force.
    pair : ndarray, shape (m, 2)
        It, and it a quarter of a period later, behind the filters of the records.
    rest : ndarray, shape (m,)
        What is left beside it, and beside the parameters.
    ends : ndarray of int, shape (r,)
        Where each record ends.
    """

    force: Ripple
    pair: Array
    rest: Array
    ends: npt.NDArray[np.intp]


def repeating(rows: Sequence[Rows], left: Array, missed: Array) -> Repeating | None:
    """The force that repeats along the way, where it is most of what is left.

    Parameters
    ----------
    rows : Sequence[Rows]
        The records.
    left : ndarray, shape (m, p)
        Regressors, records stacked.
    missed : ndarray, shape (m,)
        What they leave of the force.

    Returns
    -------
    Repeating or None
        None where there is none.
    """
    places = [evened(r, [r.run.x], [False])[:, 0] for r in rows]
    ends = np.cumsum([len(x) for x in places])
    found = ripple(np.split(missed, ends[:-1]), places, np.split(left, ends[:-1]))
    return None if found is None else beside(rows, left, missed, found)


def beside(rows: Sequence[Rows], left: Array, missed: Array, found: Ripple) -> Repeating:
    """What a force that repeats with a known period is beside the parameters, and what is left.

    Parameters
    ----------
    rows : Sequence[Rows]
        The records.
    left : ndarray, shape (m, p)
        Regressors, records stacked.
    missed : ndarray, shape (m,)
        What they leave of the force.
    found : Ripple
        Its period; size and phase are found.

    Returns
    -------
    Repeating
        The force, and what else there is.
    """

    # A quick motion makes a quick force, so both quadratures pass the filters of the record.
    def quadratures(rows: Rows) -> Array:
        turns = (found.at(rows.run.x, turn) for turn in (0.0, 0.5 * np.pi))
        return evened(rows, turns, [True, True])

    pair, lengths = stacked(rows, quadratures)
    both = np.hstack([pair, left / np.linalg.norm(left, axis=0)])
    own = np.linalg.lstsq(both, missed, rcond=None)[0]
    size = float(np.hypot(own[0], own[1]))
    turned = found.turned(float(np.arctan2(own[1], own[0])), size)
    return Repeating(turned, size * pair, missed - both @ own, np.cumsum(lengths))


def cogged(found: Repeating, guides: Array, left: Array) -> Drawn:
    """Errors of parameters under a force that repeats along the way.

    Parameters
    ----------
    found : Repeating
        The force, and what else there is.
    guides, left : ndarray, shape (m, p)
        Instruments and regressors, records stacked.

    Returns
    -------
    Drawn
        Of the parameters.
    """
    even = guides / np.linalg.norm(guides, axis=0)
    solve = np.linalg.pinv(even.T @ left) @ even.T
    phases = 2.0 * np.pi * (np.arange(_PHASES) + 0.5) / _PHASES
    turned = np.stack([np.cos(phases), np.sin(phases)], axis=1)
    draws = turned @ (solve @ found.pair).T
    noise = robust_covariance(guides, found.rest, found.ends, None, left)
    spread = draws.T @ draws / _PHASES + noise
    random = np.random.Generator(np.random.PCG64(0))  # the same data give the same errors
    return Drawn(spread, draws + normal(noise, _PHASES, random))
