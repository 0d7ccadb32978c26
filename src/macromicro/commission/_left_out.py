"""Model errors of an axis that no stroke shows, added to the result."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.axis_inverse import ECCENTRIC

# Standard deviation of what the model leaves out (bristles, the current's rise), as a part of the
# value: seen on 12 random axes of docs/make_commissioning.py, and checked on 40 others there.
PARTS = {"mass": 0.002, "viscous": 0.003, "coulomb": 0.006}
# The same of a constant force, as a part of the sliding friction (the D/A rounds what holds a
# weight to one of its steps): seen on 15 axes that sink, and checked on others.
_CONSTANT = 0.0007
# Part of lag Fv by which the mass is expected to be larger, and its standard deviation: the
# product of two shares between 0 and 1 of which nothing is known.
_ELECTRICAL = 0.25
_SOONEST, _UNSEEN = 0.02, 0.3  # periods: a lag that is none, and how far off that may be (std.)


def beside(mean: Array, names: Sequence[str], places: Array, dt: float) -> tuple[Array, Array]:
    """Correction of the parameters and of their covariance."""
    # An inductance shows as a lag, and its back-EMF as less mass: by lag Fv if all of the lag is
    # electrical and all of the slope back-EMF. The actual shares are unknown.
    known = dict(zip(names, mean.tolist(), strict=True))
    hidden = _ELECTRICAL * known["lag"] * known["viscous"]
    shift = np.array([hidden if name == "mass" else 0.0 for name in names])
    std = np.array([PARTS.get(name, 0.0) for name in names]) * (mean + shift)
    variance = std**2 + shift**2
    if known["lag"] < _SOONEST * dt:  # at its bound, where nothing says how sure it is
        variance[names.index("lag")] += (_UNSEEN * dt) ** 2
    covariance = np.diag(variance)
    at = [k for k, name in enumerate(names) if name in ("offset", *ECCENTRIC)]
    covariance[np.ix_(at, at)] += (_CONSTANT * known["coulomb"]) ** 2 * _shared(places, len(at))
    return shift, covariance


def _shared(places: Array, count: int) -> Array:
    """Covariance of a constant force and of gravity's terms, for unit variance over the travel."""
    # The model error is another force at each position. On a short travel gravity and a constant
    # force can hardly be separated.
    table = np.stack([np.ones_like(places), np.sin(places), np.cos(places)], axis=1)[:, :count]
    return np.asarray(np.linalg.pinv(table.T @ table / len(places)))
