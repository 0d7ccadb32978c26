"""What a controller is judged by: a named objective, and penalties beside it, less is better.

What is named is what decides whether a law is better. Penalties steer the search: a design
that breaks a constraint costs more the further it breaks it. Each has a name, a weight that
can be set, and a line in what a tuning says. Metrics as in `macromicro.batch`, or from a
recording by `measuring`:

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

The peak effort is that asked for after the first sample, before the limit; T0 is T of the
controller that the search starts from. A metric that cannot be computed (NaN) costs 1e6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.schema.text import printable

Metrics = Mapping[str, Array]

FAILED = 1e6
SMALL = 0.5  # counts; an overshoot below it never shows in the encoder
MICRO_BAND, MICRO_ERROR = 10.0, 5.0  # um
NEVER = 4.0  # s; twice the hold of the micro-stage's steps
MOST = 1e6  # of a penalty's weight
SLOWER = "slower"  # goes with the objective effort alone


class Scale(NamedTuple):
    """What the formulas need beside the metrics.

    Attributes
    ----------
    length : float
        Of a run [s].
    step : float
        Of a run [counts].
    time : float or ndarray
        T of the controller that the search starts from [s]; NaN until it is known.
    weights : mapping of str to float, optional
        Penalties by name; those of the stage by default.
    """

    length: float
    step: float
    time: float | Array = float("nan")
    weights: Mapping[str, float] | None = None


class Objective(NamedTuple):
    """What is minimised.

    Attributes
    ----------
    stage : {"macro", "micro"}
        Whose metrics it takes.
    name : str
        As the option names it.
    unit : str
        Of its value.
    formula : str
        As in the module's docstring.
    value : callable
        Makes it, without penalties, (n,) of metrics (n,) each.
    """

    stage: str
    name: str
    unit: str
    formula: str
    value: Callable[[Metrics, Scale], Array]


class Penalty(NamedTuple):
    """What costs beside the objective.

    Attributes
    ----------
    name : str
        As the option names it.
    weight : float
        By default, for each of what `amount` counts.
    unit : str
        Of the weight.
    meaning : str
        For a person.
    amount : callable
        Makes it, (n,) of metrics (n,) each.
    """

    name: str
    weight: float
    unit: str
    meaning: str
    amount: Callable[[Metrics, Scale], Array]


def macro_time(m: Metrics, scale: Scale) -> Array:
    """Give T of the macro-stage.

    Parameters
    ----------
    m : mapping of str to ndarray, shape (n,)
        Metrics.
    scale : Scale
        Of the runs.

    Returns
    -------
    ndarray, shape (n,)
        In s.
    """
    away = np.abs(m["final_error"]) / scale.step
    return np.where(np.isnan(m["settling_time"]), scale.length * (1.0 + away), m["settling_time"])


def micro_time(m: Metrics, scale: Scale) -> Array:
    """Give T of the micro-stage.

    Parameters
    ----------
    m : mapping of str to ndarray, shape (n,)
        Metrics.
    scale : Scale
        Of the runs.

    Returns
    -------
    ndarray, shape (n,)
        In s.
    """
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
    """Give the weights of all penalties that an objective may have.

    Parameters
    ----------
    objective : Objective
        Which one.
    asked : mapping of str to float
        Weights that were asked for.

    Returns
    -------
    dict of str to float
        By name; the others by default.

    Raises
    ------
    InputError
        An unknown one, one without effect, or a weight that is none.
    """
    known = {
        p.name: p.weight
        for p in PENALTIES[objective.stage]
        if p.name != SLOWER or objective.name == "effort"
    }
    for name, weight in asked.items():
        where = f"--penalty {printable(name)}"
        if name not in known:
            raise InputError(where, "unknown", f"one of {', '.join(known)} for {objective.name}")
        if not 0.0 <= weight <= MOST:
            raise InputError(where, weight, f"a number from 0 to {MOST:g}")
    return {**known, **asked}


def described(objective: Objective, weights: Mapping[str, float]) -> str:
    """Put into words what is minimised.

    Parameters
    ----------
    objective : Objective
        Which one.
    weights : mapping of str to float
        Of the penalties, by name.

    Returns
    -------
    str
        The objective and each of its penalties.
    """
    words = {p.name: f"{p.unit} x ({p.meaning})" for p in PENALTIES[objective.stage]}
    some = [f"{name}: {weight:g} {words[name]}" for name, weight in weights.items() if weight]
    none = [name for name, weight in weights.items() if not weight]
    text = f"{objective.name} = {objective.formula}, and penalties: {'; '.join(some) or 'none'}"
    return text + (f" (no penalty for: {', '.join(none)})" if none else "")


def find(stage: str, name: str) -> Objective:
    """Find an objective.

    Parameters
    ----------
    stage : {"macro", "micro"}
        Whose.
    name : str
        As the option names it.

    Returns
    -------
    Objective
        Of that name.

    Raises
    ------
    InputError
        There is none.
    """
    known = {o.name: o for o in OBJECTIVES[stage]}
    if name not in known:
        raise InputError("--objective", printable(name), f"one of {', '.join(known)}")
    return known[name]


def time_of(stage: str, m: Metrics, scale: Scale) -> Array:
    """Give T of a stage.

    Parameters
    ----------
    stage : {"macro", "micro"}
        Which one.
    m : mapping of str to ndarray, shape (n,)
        Metrics.
    scale : Scale
        Of the runs.

    Returns
    -------
    ndarray, shape (n,)
        In s.
    """
    return macro_time(m, scale) if stage == "macro" else micro_time(m, scale)


def values(objective: Objective, m: Metrics, scale: Scale) -> Array:
    """Give the named objective alone.

    Parameters
    ----------
    objective : Objective
        Which one.
    m : mapping of str to ndarray, shape (n,)
        Metrics.
    scale : Scale
        Of the runs.

    Returns
    -------
    ndarray, shape (n,)
        Finite: `FAILED` where a metric is missing.
    """
    return _finite(objective.value(m, scale))


def costs(objective: Objective, m: Metrics, scale: Scale) -> Array:
    """Give objective and penalties.

    Parameters
    ----------
    objective : Objective
        Which one.
    m : mapping of str to ndarray, shape (n,)
        Metrics.
    scale : Scale
        Of the runs, with the penalties' weights.

    Returns
    -------
    ndarray, shape (n,)
        Finite: `FAILED` where a metric is missing.
    """
    found = objective.value(m, scale)
    weights = penalties(objective, {}) if scale.weights is None else scale.weights
    for penalty in PENALTIES[objective.stage]:
        weight = weights.get(penalty.name, 0.0)
        if weight:
            found = found + weight * penalty.amount(m, scale)
    return _finite(found)


def _finite(found: Array) -> Array:
    return np.where(np.isfinite(found), found, FAILED)
