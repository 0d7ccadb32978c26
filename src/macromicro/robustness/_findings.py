"""Results of a study: yields, influences, worst cases."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.robustness.requirements import Requirement
from macromicro.robustness.statistics import Rank, Share, rank_correlation, share
from macromicro.robustness.study import Study
from macromicro.uncertainty.machines import centre
from macromicro.uncertainty.table import Uncertain


class Yield(NamedTuple):
    requirement: Requirement  # which one
    # of all; one that its guard stopped, of which nothing is known of what would have come, fails
    all: Share
    known: Share  # of those of which it is known
    nominal: float  # what the settings themselves give


def yields(study: Study) -> list[Yield]:
    found = []
    for requirement in study.request.requirements:
        name = requirement.metric.name
        met = study.met(requirement)
        known = int((~np.isnan(study.column(name))).sum())
        passed = int(met.sum())
        shares = share(passed, len(met)), share(passed, known)
        found.append(Yield(requirement, *shares, float(study.nominal[study.at(name)])))
    return found


def overall(study: Study) -> Share:
    met = study.met(*study.request.requirements)
    return share(int(met.sum()), len(met))


class Influence(NamedTuple):
    parameter: Uncertain  # which one
    low: float  # the metric with it alone at either end
    high: float  # NaN: not known
    effect: float  # the largest change among these and the nominal
    correlation: Rank  # rank correlation with the metric over the sample


def influences(study: Study, metric: str) -> list[Influence]:
    """All parameters' influence on a metric.

    An end whose metric is unknown, though the nominal machine's is known (the guard stopped the
    run), has an infinite effect.
    """
    column = study.at(metric)
    found = []
    middle = float(study.nominal[column])
    for k, each in enumerate(study.subject.uncertain):
        low, high = (float(v) for v in study.single[k, :, column])
        ends = [
            math.inf if math.isnan(v) and _ran(study, k, side) else v
            for side, v in enumerate((low, high))
        ]
        x = study.sample.amounts[: len(study.rows), k]
        correlation = rank_correlation(x, study.rows[:, column])
        found.append(Influence(each, low, high, _effect(middle, ends), correlation))
    return sorted(
        found, key=lambda i: (_or_less(i.effect), _or_less(abs(i.correlation.value))), reverse=True
    )


def _ran(study: Study, k: int, side: int) -> bool:
    """Whether this end of the tornado was run; a run's first metric is never NaN."""
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
    """The machine of the sample with the worst value of a metric."""

    requirement: Requirement  # on the metric
    sample: int  # index of the machine
    value: float  # of the metric
    fault: int  # the guard's code, 0 for none


def worst(study: Study) -> list[Worst]:
    """For each requirement, the worst machine whose metric is known.

    Of equals the one nearest to the nominal machine, in shares of the parameters' ranges.
    """
    found = []
    spans = np.array([u.high - u.low for u in study.subject.uncertain])
    middle = centre(study.request.settings, study.subject.uncertain)
    away = np.abs((study.sample.amounts[: len(study.rows)] - middle) / spans).sum(axis=1)
    for requirement in study.request.requirements:
        values = study.column(requirement.metric.name)
        if np.isnan(values).all():
            continue
        most = np.nanmax(values)
        equal = np.flatnonzero(values == most)
        index = int(equal[np.argmin(away[equal])])
        code = int(study.rows[index, -1])
        found.append(Worst(requirement, index, float(most), code))
    return found


def strongest(study: Study) -> tuple[str, list[Influence]]:
    """The influences on the requirement that is met least often; the first of equals."""
    name = min(yields(study), key=lambda y: y.all.share).requirement.metric.name
    ranked = influences(study, name)
    return name, sorted(ranked, key=lambda i: _or_less(abs(i.correlation.value)), reverse=True)
