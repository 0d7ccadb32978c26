"""How often the live machine looks: once in a whole number of control periods."""

from __future__ import annotations

import math
from typing import Any

from macromicro.nominal import PERIOD

LEAST = PERIOD  # s; shortest period of the live machine, in which it computes for a third of that
_NEAR = 1e-9  # of a period


def periods(tree: Any) -> int:
    """How many control periods of a machine make one of the live machine.

    Parameters
    ----------
    tree : Any
        Settings of the machine.

    Returns
    -------
    int
        1 for a control period of `LEAST` or more, else as few as last so long.
    """
    return max(math.ceil(LEAST / float(tree.timing.period) - _NEAR), 1)


def period(tree: Any) -> float:
    """Period of the live machine.

    Parameters
    ----------
    tree : Any
        Settings of the machine.

    Returns
    -------
    float
        s.
    """
    return periods(tree) * float(tree.timing.period)
