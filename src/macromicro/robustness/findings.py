"""What a study says: yields, influences, worst cases."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.robustness.metrics import NAMES
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.statistics import Share, rank_correlation, share
from macromicro.robustness.study import Study
from macromicro.uncertainty.machines import centre
from macromicro.uncertainty.table import Uncertain


class Yield(NamedTuple):
    """How many machines meet a requirement.

    Attributes
    ----------
    requirement : Requirement
        Which one.
    all : Share
        Of all; one that its guard stopped, of which nothing is known of what would have come,
        fails.
    known : Share
        Of those of which it is known.
    nominal : float
        What the settings themselves give.
    """

    requirement: Requirement
    all: Share
    known: Share
    nominal: float


def yields(study: Study) -> list[Yield]:
    """Give each requirement's yield.

    Parameters
    ----------
    study : Study
        What was computed.

    Returns
    -------
    list of Yield
        In the requirements' order.
    """
    found = []
    for requirement in study.request.requirements:
        column = NAMES.index(requirement.metric.name)
        met = requirement.met(study.rows)
        known = int((~np.isnan(study.rows[:, column])).sum())
        passed = int(met.sum())
        found.append(
            Yield(
                requirement,
                share(passed, len(met)),
                share(passed, known),
                float(study.nominal[column]),
            )
        )
    return found


def overall(study: Study) -> Share:
    """Give the share of machines that meet every requirement.

    Parameters
    ----------
    study : Study
        What was computed.

    Returns
    -------
    Share
        Of all of them.
    """
    met = np.ones(len(study.rows), dtype=bool)
    for requirement in study.request.requirements:
        met &= requirement.met(study.rows)
    return share(int(met.sum()), len(met))


class Influence(NamedTuple):
    """What one parameter does to one metric.

    Attributes
    ----------
    parameter : Uncertain
        Which one.
    low, high : float
        The metric with it alone at either end; NaN: not known.
    effect : float
        The largest change among these and the nominal.
    correlation : float
        Rank correlation with the metric over the sample.
    """

    parameter: Uncertain
    low: float
    high: float
    effect: float
    correlation: float


def influences(study: Study, metric: str) -> list[Influence]:
    """Give all parameters' influence on a metric.

    An end at which the metric is not known, though it is of the nominal machine (the guard stopped
    the run), is a change beyond measure: effect infinity.

    Parameters
    ----------
    study : Study
        What was computed.
    metric : str
        Its name.

    Returns
    -------
    list of Influence
        The largest effect first.
    """
    column = NAMES.index(metric)
    found = []
    middle = float(study.nominal[column])
    for k, each in enumerate(study.request.uncertain):
        low, high = (float(v) for v in study.single[k, :, column])
        ends = [
            math.inf if math.isnan(v) and _ran(study, k, side) else v
            for side, v in enumerate((low, high))
        ]
        x = study.sample.amounts[: len(study.rows), k]
        correlation = rank_correlation(x, study.rows[:, column])
        found.append(Influence(each, low, high, _effect(middle, ends), correlation))
    return sorted(
        found, key=lambda i: (_or_less(i.effect), _or_less(abs(i.correlation))), reverse=True
    )


def _ran(study: Study, k: int, side: int) -> bool:
    """Was this end of the tornado run at all? A run's first metric is never NaN."""
    return not math.isnan(study.single[k, side, 0])


def _effect(middle: float, ends: Sequence[float]) -> float:
    values = [v for v in (middle, *ends) if not math.isnan(v)]
    if math.isnan(middle) or len(values) < 2:
        return math.nan
    least, most = min(values), max(values)
    return 0.0 if least == most else most - least


def _or_less(value: float) -> float:
    return -1.0 if math.isnan(value) else value


class Worst(NamedTuple):
    """The machine of the sample that does worst by a metric.

    Attributes
    ----------
    requirement : Requirement
        On the metric.
    sample : int
        Index of the machine.
    value : float
        Of the metric.
    fault : int
        The guard's code, 0 for none.
    """

    requirement: Requirement
    sample: int
    value: float
    fault: int


def worst(study: Study) -> list[Worst]:
    """Give, for each requirement, the worst machine of which the metric is known.

    Of equals the one nearest to the nominal machine, each parameter counted in its range.

    Parameters
    ----------
    study : Study
        What was computed.

    Returns
    -------
    list of Worst
        In the requirements' order.
    """
    found = []
    spans = np.array([u.high - u.low for u in study.request.uncertain])
    middle = centre(study.request.settings, study.request.uncertain)
    away = np.abs((study.sample.amounts[: len(study.rows)] - middle) / spans).sum(axis=1)
    for requirement in study.request.requirements:
        values = study.rows[:, NAMES.index(requirement.metric.name)]
        if np.isnan(values).all():
            continue
        most = np.nanmax(values)
        equal = np.flatnonzero(values == most)
        index = int(equal[np.argmin(away[equal])])
        code = int(study.rows[index, NAMES.index("fault_code")])
        found.append(Worst(requirement, index, float(most), code))
    return found


def strongest(study: Study) -> tuple[str, list[Influence]]:
    """Give what matters most to the requirement that is met least often, of equals the first.

    Parameters
    ----------
    study : Study
        What was computed.

    Returns
    -------
    metric : str
        The requirement's.
    influences : list of Influence
        Of all parameters, the one with the largest rank correlation first.
    """
    name = min(yields(study), key=lambda y: y.all.share).requirement.metric.name
    ranked = influences(study, name)
    return name, sorted(ranked, key=lambda i: _or_less(abs(i.correlation)), reverse=True)
