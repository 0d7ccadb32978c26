"""Objectives and penalties of a tuning; less is better.

The objective decides which law is better; penalties steer the search by the size of a
violation. Metrics as in `macromicro.batch`, or from a recording by `measuring`:

macro, with the step r [counts] and the run's length L [s]

    T = settling time [s] into 2 %; where it never settles, L (1 + |final error| / r)
    settling  T        [s]
    iae       IAE / r  [s]
    effort    peak effort / 1 V
    overshoot 1 s/count * max(0, overshoot - 0.5 count)
    saturated weight * samples saturated after the first; none unless asked for
    slower    10 * max(0, T / T0 - 1), of effort alone

micro, T from the mean settling up and the mean settling down [s] into 10 um

    T = settling up + settling down; 4 s for one that never settles
    settling  T          [s]
    iae       IAE / 1 mm [s]
    effort    share of the samples saturated
    overshoot 50 ms/um * max(0, overshoot - 10 um)
    error     50 ms/um * max(0, worst error - 5 um)
    slower    10 * max(0, T / T0 - 1), of effort alone

The peak effort is the one requested after the first sample, before the limit; T0 is T of
the search's first controller. A metric that cannot be computed (NaN) costs 1e6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.schema.text import printable

Metrics = Mapping[str, Array]

FAILED = 1e6
SMALL = 0.5  # counts; an overshoot below it never shows in the encoder
MICRO_BAND, MICRO_ERROR = 10.0, 5.0  # um
NEVER = 4.0  # s; twice the hold of the micro-stage's steps
MOST = 1e6  # of a penalty's weight
SLOWER = "slower"  # goes with the objective effort alone


class Scale(NamedTuple):
    """Quantities of the formulas other than the metrics."""

    length: float  # of a run [s]
    step: float  # of a run [counts]
    # T of the controller that the search starts from [s]; NaN until it is known
    time: float | Array = float("nan")
    weights: Mapping[str, float] | None = None  # penalties by name; those of the stage by default


class Objective(NamedTuple):
    stage: str  # whose metrics it takes
    name: str  # as the option names it
    unit: str  # of its value
    formula: str  # as in the module's docstring
    # makes it, without penalties, (n,) of metrics (n,) each
    value: Callable[[Metrics, Scale], Array]


class Penalty(NamedTuple):
    name: str  # as the option names it
    weight: float  # by default, for each of what `amount` counts
    unit: str  # of the weight
    meaning: str  # for a person
    amount: Callable[[Metrics, Scale], Array]  # makes it, (n,) of metrics (n,) each


def macro_time(m: Metrics, scale: Scale) -> Array:
    """T of the macro-stage."""
    away = np.abs(m["final_error"]) / scale.step
    return np.where(np.isnan(m["settling_time"]), scale.length * (1.0 + away), m["settling_time"])


def micro_time(m: Metrics, scale: Scale) -> Array:
    """T of the micro-stage."""
    up, down = m["settle_up"], m["settle_down"]
    found: Array = np.where(np.isnan(up), NEVER, up) + np.where(np.isnan(down), NEVER, down)
    return found


def _beyond(name: str, free: float) -> Callable[[Metrics, Scale], Array]:
    return lambda m, s: np.maximum(0.0, m[name] - free)


def _slower(stage: str) -> Penalty:
    def amount(m: Metrics, scale: Scale) -> Array:
        found: Array = np.maximum(0.0, time_of(stage, m, scale) / scale.time - 1.0)
        return found

    return Penalty(SLOWER, 10.0, "1", "T / T0 - 1, where it is above 0", amount)


PENALTIES = {
    "macro": (
        Penalty("overshoot", 1.0, "s/count", "overshoot - 0.5 count", _beyond("overshoot", SMALL)),
        Penalty(
            "saturated", 0.0, "s", "sample saturated after the first", _beyond("saturated", 0.0)
        ),
        _slower("macro"),
    ),
    "micro": (
        Penalty("overshoot", 0.05, "s/um", "overshoot - 10 um", _beyond("overshoot", MICRO_BAND)),
        Penalty("error", 0.05, "s/um", "worst error - 5 um", _beyond("worst_error", MICRO_ERROR)),
        _slower("micro"),
    ),
}

_MACRO = (
    Objective("macro", "settling", "s", "T", macro_time),
    Objective("macro", "iae", "s", "IAE / step", lambda m, s: m["iae"] / s.step),
    Objective("macro", "effort", "1", "peak effort / 1 V", lambda m, s: m["peak_effort"]),
)
_MICRO = (
    Objective("micro", "settling", "s", "T", micro_time),
    Objective("micro", "iae", "s", "IAE / 1 mm", lambda m, s: m["iae"]),
    Objective("micro", "effort", "1", "share saturated", lambda m, s: m["saturated"]),
)
OBJECTIVES = {"macro": _MACRO, "micro": _MICRO}


def penalties(objective: Objective, asked: Mapping[str, float]) -> dict[str, float]:
    known = {
        p.name: p.weight
        for p in PENALTIES[objective.stage]
        if p.name != SLOWER or objective.name == "effort"
    }
    for name, weight in asked.items():
        where = f"--penalty {printable(name)}"
        if name not in known:
            raise ProblemError(
                where, "unknown penalty", f"Accepted for {objective.name}: {', '.join(known)}."
            )
        if not 0.0 <= weight <= MOST:
            raise InputError(where, weight, f"a number from 0 to {MOST:g}")
    return {**known, **asked}


def described(objective: Objective, weights: Mapping[str, float]) -> str:
    words = {p.name: f"{p.unit} x ({p.meaning})" for p in PENALTIES[objective.stage]}
    some = [f"{name}: {weight:g} {words[name]}" for name, weight in weights.items() if weight]
    none = [name for name, weight in weights.items() if not weight]
    text = f"{objective.name} = {objective.formula}, and penalties: {'; '.join(some) or 'none'}"
    return text + (f" (no penalty for: {', '.join(none)})" if none else "")


def find(stage: str, name: str) -> Objective:
    known = {o.name: o for o in OBJECTIVES[stage]}
    if name not in known:
        raise InputError("--objective", printable(name), f"one of {', '.join(known)}")
    return known[name]


def time_of(stage: str, m: Metrics, scale: Scale) -> Array:
    """T of a stage."""
    return macro_time(m, scale) if stage == "macro" else micro_time(m, scale)


def values(objective: Objective, m: Metrics, scale: Scale) -> Array:
    """The objective without penalties."""
    return _finite(objective.value(m, scale))


def costs(objective: Objective, m: Metrics, scale: Scale) -> Array:
    """The objective with penalties."""
    found = objective.value(m, scale)
    weights = penalties(objective, {}) if scale.weights is None else scale.weights
    for penalty in PENALTIES[objective.stage]:
        weight = weights.get(penalty.name, 0.0)
        if weight:
            found = found + weight * penalty.amount(m, scale)
    return _finite(found)


def _finite(found: Array) -> Array:
    return np.where(np.isfinite(found), found, FAILED)
