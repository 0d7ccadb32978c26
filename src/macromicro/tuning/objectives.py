"""What a controller is judged by: a cost from the metrics of a run, less is better.

Constraints enter as penalties, so that a design that breaks one is worse the further it
breaks it, and the search finds its way back. In the formulas below (metrics as in
`macromicro.batch`, or from a recording by `measuring`):

macro, with the step r [counts] and the run's length L [s]

    T = settling time [s] into 2 %; where it never settles, L (1 + |final error| / r)
    P = 1 s/count * max(0, overshoot - 0.5 count) + 10 ms * samples saturated after the first
    settling  J = T + P                                             [s]
    iae       J = IAE / r + P                                       [s]
    effort    J = peak effort / 1 V + 10 max(0, T / T0 - 1) + P / 1 s

Where the effort may saturate, P lacks its second term.

micro, T from the mean settling up and the mean settling down [s] into 10 um

    T = settling up + settling down; 4 s for one that never settles
    P = 50 ms/um * max(0, overshoot - 10 um) + 50 ms/um * max(0, worst error - 5 um)
    settling  J = T + P                                             [s]
    iae       J = IAE / 1 mm + P                                    [s]
    effort    J = share of the samples saturated + 10 max(0, T / T0 - 1) + P / 1 s

The peak effort is that asked for after the first sample, before the limit; T0 is T of the
controller that the search starts from. A metric that cannot be computed (NaN) costs 1e6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError
from macromicro.textfile import printable

Array = npt.NDArray[np.float64]
Metrics = Mapping[str, Array]

FAILED = 1e6
SMALL = 0.5  # counts; an overshoot below it never shows in the encoder
OVER, SATURATED = 1.0, 0.01  # s/count, s/sample
MICRO_BAND, MICRO_ERROR, MICRO_WEIGHT = 10.0, 5.0, 0.05  # um, um, s/um
NEVER = 4.0  # s; twice the hold of the micro-stage's steps
SLOWER = 10.0


class Scale(NamedTuple):
    """What the formulas need beside the metrics: length [s] and step [counts] of a run, and
    T [s] of the controller that the search starts from (NaN until it is known); `saturated`:
    what a saturated sample costs [s]."""

    length: float
    step: float
    time: float | Array = float("nan")
    saturated: float = SATURATED


class Objective(NamedTuple):
    """`formula` as above; `cost` makes costs (n,) of metrics (n,) each."""

    name: str
    unit: str
    formula: str
    cost: Callable[[Metrics, Scale], Array]


def macro_time(m: Metrics, scale: Scale) -> Array:
    """T of the macro-stage [s]."""
    away = np.abs(m["final_error"]) / scale.step
    return np.where(np.isnan(m["settling_time"]), scale.length * (1.0 + away), m["settling_time"])


def macro_penalty(m: Metrics, scale: Scale) -> Array:
    """P of the macro-stage [s]."""
    over: Array = OVER * np.maximum(0.0, m["overshoot"] - SMALL)
    return over + scale.saturated * m["saturated"]


def micro_time(m: Metrics, scale: Scale) -> Array:
    """T of the micro-stage [s]."""
    up, down = m["settle_up"], m["settle_down"]
    found: Array = np.where(np.isnan(up), NEVER, up) + np.where(np.isnan(down), NEVER, down)
    return found


def micro_penalty(m: Metrics) -> Array:
    """P of the micro-stage [s]."""
    over = np.maximum(0.0, m["overshoot"] - MICRO_BAND)
    found: Array = MICRO_WEIGHT * (over + np.maximum(0.0, m["worst_error"] - MICRO_ERROR))
    return found


def _slower(time: Array, scale: Scale) -> Array:
    return SLOWER * np.maximum(0.0, time / scale.time - 1.0)


_P = "1 s/count max(0, overshoot - 0.5) + 10 ms x samples saturated after the first"
_Q = "50 ms/um max(0, overshoot - 10 um) + 50 ms/um max(0, worst error - 5 um)"
_S = "10 max(0, T / T0 - 1)"

_MACRO = (
    Objective("settling", "s", f"T + {_P}", lambda m, s: macro_time(m, s) + macro_penalty(m, s)),
    Objective(
        "iae", "s", f"IAE / step + {_P}", lambda m, s: m["iae"] / s.step + macro_penalty(m, s)
    ),
    Objective(
        "effort",
        "1",
        f"peak effort / 1 V + {_S} + {_P}",
        lambda m, s: m["peak_effort"] + _slower(macro_time(m, s), s) + macro_penalty(m, s),
    ),
)
_MICRO = (
    Objective("settling", "s", f"T + {_Q}", lambda m, s: micro_time(m, s) + micro_penalty(m)),
    Objective("iae", "s", f"IAE / 1 mm + {_Q}", lambda m, s: m["iae"] + micro_penalty(m)),
    Objective(
        "effort",
        "1",
        f"share saturated + {_S} + {_Q}",
        lambda m, s: m["saturated"] + _slower(micro_time(m, s), s) + micro_penalty(m),
    ),
)
OBJECTIVES = {"macro": _MACRO, "micro": _MICRO}


def find(stage: str, name: str) -> Objective:
    """The objective `name` of a stage; raises `InputError` where there is none."""
    known = {o.name: o for o in OBJECTIVES[stage]}
    if name not in known:
        raise InputError("--objective", printable(name), f"one of {', '.join(known)}")
    return known[name]


def time_of(stage: str, m: Metrics, scale: Scale) -> Array:
    """T [s] (n,) of a stage."""
    return macro_time(m, scale) if stage == "macro" else micro_time(m, scale)


def costs(objective: Objective, m: Metrics, scale: Scale) -> Array:
    """Costs (n,), finite: `FAILED` where a metric is missing."""
    found = objective.cost(m, scale)
    return np.where(np.isfinite(found), found, FAILED)
