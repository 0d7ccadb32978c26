"""The whole study: the nominal machine, the sample, one parameter at a time, and what it says."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro import batch
from macromicro.batch import Job
from macromicro.robustness.job import variants
from macromicro.robustness.metrics import NAMES
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.statistics import Share, rank_correlation, share
from macromicro.settings import Settings
from macromicro.uncertainty.machines import Sample, centre, draw, refusal, settings_at
from macromicro.uncertainty.table import UNCERTAIN, Uncertain

Floats = NDArray[np.float64]

LEAST, MOST = 10, 100_000  # machines of a sample


class Request(NamedTuple):
    """What to study.

    Attributes
    ----------
    settings : Settings
        The nominal machine.
    requirements : tuple of Requirement
        What machines must do.
    samples : int
        Machines to draw, from `LEAST` to `MOST`.
    seed : int
        Of the sample and the noise; run i of the sample has the noise of `seed` + i, the nominal
        machine and the runs of the tornado that of `seed`.
    workers : int
        Threads.
    uncertain : tuple of Uncertain
        Rows of the table, by default all of them.
    """

    settings: Settings
    requirements: tuple[Requirement, ...]
    samples: int
    seed: int
    workers: int
    uncertain: tuple[Uncertain, ...] = UNCERTAIN


class Study(NamedTuple):
    """What was computed, perhaps less than asked for.

    Attributes
    ----------
    request : Request
        What was asked for.
    sample : Sample
        The machines.
    nominal : ndarray, shape (metrics,)
        Of the settings themselves.
    rows : ndarray, shape (m, metrics)
        Of the first m of the sample's machines.
    single : ndarray, shape (k, 2, metrics)
        Each parameter alone at its low and high end, the rest nominal; NaN where it was not run.
    impossible : dict of str to str
        Ends at which no machine is, with the reason.
    interrupted : bool
        Whether something is missing.
    """

    request: Request
    sample: Sample
    nominal: Floats
    rows: Floats
    single: Floats
    impossible: dict[str, str]
    interrupted: bool


def run(
    request: Request,
    job: Job,
    progress: Callable[[int, int], None] = lambda done, total: None,
    stop: Callable[[], bool] = lambda: False,
) -> Study:
    """Compute everything.

    Parameters
    ----------
    request : Request
        What to study.
    job : Job
        A batch's on the tree of the settings, with a noise seed for each variant, that gives
        `metrics.METRICS`.
    progress : callable
        Told runs done and in all.
    stop : callable
        When it turns true, the rest is left out.

    Returns
    -------
    Study
        What was computed.

    Raises
    ------
    InputError
        Hardly any machine is possible around these settings.
    """
    base, uncertain = request.settings, request.uncertain
    sample = draw(base, uncertain, request.samples, request.seed)
    ends, impossible = _ends(request)
    machines = [settings_at(base, uncertain, amounts) for amounts in sample.amounts]
    trees = [base, *machines, *ends.values()]
    seeds = [request.seed + i for i in range(len(machines))]
    seeds = [request.seed, *seeds, *[request.seed] * len(ends)]
    done: list[Floats] = []
    for _, piece in batch.run(job, variants(uncertain, trees, seeds), request.workers):
        done.extend(piece)
        progress(len(done), len(trees))
        if stop():
            break
    table = np.array(done).reshape(-1, len(job.metrics))
    nominal = table[0] if len(table) else np.full(len(job.metrics), math.nan)
    single = np.full((len(uncertain), 2, table.shape[1]), math.nan)
    for place, row in zip(ends, table[1 + request.samples :], strict=False):
        single[place] = row
    rows = table[1 : 1 + request.samples]
    complete = len(table) == len(trees)
    return Study(request, sample, nominal, rows, single, impossible, not complete)


def _ends(request: Request) -> tuple[dict[tuple[int, int], Settings], dict[str, str]]:
    """The settings with one parameter at an end, and which ends are no machine."""
    found, impossible = {}, {}
    middle = centre(request.settings, request.uncertain)
    for k, each in enumerate(request.uncertain):
        for side, end in enumerate((each.low, each.high)):
            amounts = middle.copy()
            amounts[k] = end
            tree = settings_at(request.settings, request.uncertain, amounts)
            why = refusal(tree, request.uncertain)
            if why is None:
                found[k, side] = tree
            else:
                impossible[f"{each.name} {('low', 'high')[side]}"] = why
    return found, impossible


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
