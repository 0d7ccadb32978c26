"""Assumptions of `drive` about the drive, its load and its records."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.axis import late


class Filtering(NamedTuple):
    """How positions are differentiated for inverse dynamics.

    Examples
    --------
    >>> from macromicro.identify import Filtering
    >>> Filtering(cutoff=40.0)  # Hz
    Filtering(cutoff=40.0, decimate=None)
    """

    #: cut-off of the zero-phase low-pass on positions, Hz; by default 0.08 / dt
    cutoff: float | None = None
    #: every how many samples remain, after a low-pass on force and regressors alike; by default 10,
    #: fewer for short records
    decimate: int | None = None


USUAL = Filtering()
FIT = "fit"  # in place of a delay: found with the parameters


class Driven(NamedTuple):
    gain: float = 1.0  # force per unit of u
    limit: float | None = None  # u saturates there
    delay: int = 0  # samples by which u acts late
    eccentric: bool = False  # eccentric load under gravity
    filtering: Filtering = USUAL
    holdout: float = 0.3  # part of each record that is held out

    def force(self, u: Array) -> Array:
        within = u if self.limit is None else np.clip(u, -self.limit, self.limit)
        pull = late(within, self.delay)
        return pull if self.gain == 1.0 else self.gain * pull  # no copy: records may be long
