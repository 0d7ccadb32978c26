"""What `drive` is asked: what the drive makes of its input, and how its records are taken."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.axis import late


class Filtering(NamedTuple):
    """How positions are differentiated for inverse dynamics.

    Attributes
    ----------
    cutoff : float | None
        Cut-off of the zero-phase low-pass on positions, Hz; by default 0.08 / dt.
    decimate : int | None
        Every how many samples remain, after a low-pass on force and regressors alike; by default
        10, fewer for short records.
    """

    cutoff: float | None = None
    decimate: int | None = None


USUAL = Filtering()
FIT = "fit"  # in place of a delay: found with the parameters


class Driven(NamedTuple):
    """What the drive makes of its input, what pulls beside it, and how records are taken.

    Attributes
    ----------
    gain : float
        Force per unit of u.
    limit : float | None
        u saturates there.
    delay : int
        Samples by which u acts late.
    eccentric : bool
        Whether gravity pulls at an eccentric load.
    filtering : Filtering
        How the position is filtered and all columns decimated.
    holdout : float
        Part of each record that is held out.
    """

    gain: float = 1.0
    limit: float | None = None
    delay: int = 0
    eccentric: bool = False
    filtering: Filtering = USUAL
    holdout: float = 0.3

    def force(self, u: Array) -> Array:
        """What the drive makes of an input.

        Parameters
        ----------
        u : ndarray, shape (n,)
            As it was asked for.

        Returns
        -------
        ndarray, shape (n,)
            Force within the drive's limit, as late as it acts; `u` itself where that is the same.
        """
        within = u if self.limit is None else np.clip(u, -self.limit, self.limit)
        pull = late(within, self.delay)
        return pull if self.gain == 1.0 else self.gain * pull  # no copy: records may be long
