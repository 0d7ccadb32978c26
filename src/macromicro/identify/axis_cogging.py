"""How sure inverse dynamics is of an axis' parameters where a force repeats along its way.

Cogging is no noise: how quickly it changes goes with the speed, and an autoregression of what is
left knows a mean of that. Where most of what is left is one harmonic of the place (`ripple`), it is
drawn in any phase, and what it leaves is taken for noise.
"""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.axis_inverse import Rows, evened
from macromicro.identify.counts import Rounded
from macromicro.identify.ripple import ripple
from macromicro.identify.spread import robust_covariance

_PHASES = 200


def cogged(rows: list[Rows], guides: Array, left: Array, missed: Array) -> Rounded | None:
    """Errors of parameters under a force that repeats along the way.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    guides, left : ndarray, shape (m, p)
        Instruments and regressors, records stacked.
    missed : ndarray, shape (m,)
        What the regressors leave of the force.

    Returns
    -------
    Rounded or None
        None where no such force is most of what is left.
    """
    places = [evened(r, r.run.x[:, None].copy(), [])[:, 0] for r in rows]
    cuts = np.cumsum([len(x) for x in places])
    parts = np.split(missed, cuts[:-1])
    found = ripple(parts, places, np.split(left, cuts[:-1]))
    if found is None:
        return None
    size = np.linalg.norm(guides, axis=0)
    even = guides / size
    solve = np.linalg.pinv(even.T @ left) @ even.T
    # A quick motion makes a quick force, so both quadratures pass the filters of the record.
    pair = np.concatenate([
        evened(r, np.stack([found.at(r.run.x), found.at(r.run.x, 0.5 * np.pi)], axis=1), [0, 1])
        for r in rows
    ])  # fmt: skip
    both = np.hstack([pair, left / np.linalg.norm(left, axis=0)])
    own = np.linalg.lstsq(both, missed, rcond=None)[0]
    rest = missed - both @ own
    phases = 2.0 * np.pi * (np.arange(_PHASES) + 0.5) / _PHASES
    turned = float(np.hypot(own[0], own[1])) * np.stack([np.cos(phases), np.sin(phases)], axis=1)
    draws = turned @ (solve @ pair).T
    noise = robust_covariance(guides, rest, cuts, None, left)
    spread = draws.T @ draws / _PHASES + noise
    random = np.random.Generator(np.random.PCG64(0))  # the same data give the same errors
    draws += random.multivariate_normal(np.zeros(len(noise)), noise, _PHASES, method="svd")
    return Rounded(spread, draws)
