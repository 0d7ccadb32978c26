"""The period of the live machine: a whole number of control periods."""

from __future__ import annotations

import math
from typing import Any

from macromicro.nominal import PERIOD

LEAST = PERIOD  # s; shortest period of the live machine, in which it computes for a third of that
_NEAR = 1e-9  # of a period


def periods(tree: Any) -> int:
    return max(math.ceil(LEAST / float(tree.timing.period) - _NEAR), 1)


def period(tree: Any) -> float:
    return periods(tree) * float(tree.timing.period)
