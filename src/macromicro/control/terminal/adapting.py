"""What a run has taught of the friction, for the next one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from macromicro.arrays import Array
from macromicro.control.terminal.model import Terminal

LEAST = 50  # periods of motion; fewer tell too little


def adapted(p: Terminal, run: Mapping[str, Array]) -> Terminal:
    """The model whose Coulomb friction is what the law found on its ways.

    Within a run the estimate follows the friction of each place. From run to run its median over
    all periods in motion is kept: the level about which the friction of the places lies.

    Parameters
    ----------
    p : Terminal
        Model under which the run was made.
    run : Mapping[str, ndarray]
        `speed` (mm/s) and `friction` (V), as recorded.

    Returns
    -------
    Terminal
        The same where the carriage hardly moved.
    """
    moving = run["friction"][np.abs(run["speed"]) > 0.0]
    if len(moving) < LEAST:
        return p
    return p._replace(coulomb=max(round(p.coulomb + float(np.median(moving)), 4), 0.0))
