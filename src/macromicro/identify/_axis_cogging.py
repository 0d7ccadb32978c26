"""Standard errors of inverse dynamics under a force that is periodic in the position."""

# Cogging is no noise: its frequency depends on the speed, which an autoregression averages. If one
# harmonic of the position dominates the residual (`ripple`), it is drawn with a random phase and
# only the rest is treated as noise.

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify._ripple import Ripple, ripple
from macromicro.identify._spread import robust_covariance
from macromicro.identify.axis_inverse import Rows, evened, stacked
from macromicro.identify.coverage import Drawn, normal

_PHASES = 200


class Repeating(NamedTuple):
    force: Ripple
    pair: Array  # it, and it a quarter of a period later, behind the filters of the records
    rest: Array  # residual
    ends: npt.NDArray[np.intp]  # ends of the records


def repeating(rows: Sequence[Rows], left: Array, missed: Array) -> Repeating | None:
    places = [evened(r, [r.run.x], [False])[:, 0] for r in rows]
    ends = np.cumsum([len(x) for x in places])
    found = ripple(np.split(missed, ends[:-1]), places, np.split(left, ends[:-1]))
    return None if found is None else beside(rows, left, missed, found)


def beside(rows: Sequence[Rows], left: Array, missed: Array, found: Ripple) -> Repeating:
    """A periodic force of known period, with what it adds to the regressors and what remains."""

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
    even = guides / np.linalg.norm(guides, axis=0)
    solve = np.linalg.pinv(even.T @ left) @ even.T
    phases = 2.0 * np.pi * (np.arange(_PHASES) + 0.5) / _PHASES
    turned = np.stack([np.cos(phases), np.sin(phases)], axis=1)
    draws = turned @ (solve @ found.pair).T
    noise = robust_covariance(guides, found.rest, found.ends, None, left)
    spread = draws.T @ draws / _PHASES + noise
    random = np.random.Generator(np.random.PCG64(0))  # the same data give the same errors
    return Drawn(spread, draws + normal(noise, _PHASES, random))
