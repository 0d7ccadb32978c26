"""The study in words: the same lines for terminal, page and files."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.robustness.findings import Influence, Worst, Yield, influences, yields
from macromicro.robustness.metrics import METRICS, QUANTITIES
from macromicro.robustness.statistics import LEVELS, Share, spread
from macromicro.robustness.study import Study
from macromicro.uncertainty.table import FACTOR, VALUE, Uncertain

# What a tornado is drawn of, in this order.
MAIN = ("macro_settling", "macro_overshoot", "micro_error", "contraction", "extension", "vibration")
_BY_NAME = {m.name: m for m in METRICS}
YIELD_HEADINGS = ("requirement", "limit", "nominal", "met", "yield", "95 % interval", "where known")


class About(NamedTuple):
    """How a study was asked for.

    Attributes
    ----------
    programme : str
        As on the command line.
    title : str
        Of the programme.
    fan : bool
        Whether a fan cooled the actuator.
    started : str
        When.
    seconds : float
        That it took.
    overrides : dict of str to str
        The settings that are not the defaults.
    software : tuple of (str, str)
        Name and version.
    """

    programme: str
    title: str
    fan: bool
    started: str
    seconds: float
    overrides: dict[str, str]
    software: tuple[tuple[str, str], ...]


def number(value: float, unit: str = "") -> str:
    """Put a metric's value into words.

    Parameters
    ----------
    value : float
        In `unit`.
    unit : str
        "" for none.

    Returns
    -------
    str
        "never" for infinity, "-" for NaN.
    """
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "never"
    return f"{round(value, 3):.4g}{f' {unit}' if unit else ''}"


def percent(value: float) -> str:
    """Put a share into words.

    Parameters
    ----------
    value : float
        From 0 to 1.

    Returns
    -------
    str
        To a tenth of a percent.
    """
    return "-" if math.isnan(value) else f"{100.0 * value:.1f} %"


def interval(found: Share) -> str:
    """Put a share's confidence interval into words.

    Parameters
    ----------
    found : Share
        With its bounds.

    Returns
    -------
    str
        "-" for none of none.
    """
    return f"{percent(found.low)} to {percent(found.high)}" if found.total else "-"


def yield_rows(study: Study, whole: Share) -> list[tuple[str, ...]]:
    """Give a line for each requirement, and one for all together.

    Parameters
    ----------
    study : Study
        What was computed.
    whole : Share
        That meets all of them.

    Returns
    -------
    list of tuple of str
        Under `YIELD_HEADINGS`.
    """
    lines = [_yield(y) for y in yields(study)]
    met = f"{whole.passed} of {whole.total}"
    return [*lines, ("all together", "", "", met, percent(whole.share), interval(whole), "")]


def _yield(y: Yield) -> tuple[str, ...]:
    metric = y.requirement.metric
    return (
        metric.meaning,
        y.requirement.text,
        number(y.nominal, metric.unit),
        f"{y.all.passed} of {y.all.total}",
        percent(y.all.share),
        interval(y.all),
        f"{percent(y.known.share)} of {y.known.total}" if y.known.total < y.all.total else "",
    )


def top_influences(study: Study, metric: str, count: int) -> list[Influence]:
    """Give the parameters that alone change a metric most, those with no effect left out.

    Parameters
    ----------
    study : Study
        What was computed.
    metric : str
        Its name.
    count : int
        At most so many.

    Returns
    -------
    list of Influence
        The largest effect first.
    """
    return [i for i in influences(study, metric) if i.effect > 0.0][:count]


def influence(study: Study, metric: str, count: int = 3) -> str:
    """Put the largest influences on a metric into words.

    Parameters
    ----------
    study : Study
        What was computed.
    metric : str
        Its name.
    count : int
        At most so many.

    Returns
    -------
    str
        One line.
    """
    unit = _BY_NAME[metric].unit
    parts = [
        f"{i.parameter.name} ({amount(i.parameter, i.parameter.low)}: {_end(i, i.low, unit)}, "
        f"{amount(i.parameter, i.parameter.high)}: {_end(i, i.high, unit)})"
        for i in top_influences(study, metric, count)
    ]
    ran = int((~np.isnan(study.single[:, :, 0])).sum())
    return ", ".join(parts) or ("nothing that was varied moves it" if ran else "not run")


def _end(i: Influence, value: float, unit: str) -> str:
    """The metric at one end; an end without a value, of an infinite effect, was stopped."""
    return "stopped" if math.isnan(value) and math.isinf(i.effect) else number(value, unit)


def amount(each: Uncertain, value: float) -> str:
    """Say where a parameter stands on its scale.

    Parameters
    ----------
    each : Uncertain
        The row.
    value : float
        An amount.

    Returns
    -------
    str
        Such as "+30 %", "-10 K", "35 degC".
    """
    if each.kind == FACTOR:
        return f"{_signed(100.0 * (value - 1.0))} %"
    return f"{value:.3g} {each.unit}" if each.kind == VALUE else f"{_signed(value)} {each.unit}"


def _signed(value: float) -> str:
    return f"{value:+.3g}" if round(value, 9) else "0"


def file_name(found: Worst) -> str:
    """Name the file that a worst case is written to.

    Parameters
    ----------
    found : Worst
        The case.

    Returns
    -------
    str
        Within the study's folder.
    """
    return f"worst-{found.requirement.metric.name}.toml"


def replay(study: Study, found: Worst, about: About, folder: str) -> str:
    """Give the command that repeats a worst case.

    Parameters
    ----------
    study : Study
        What was computed.
    found : Worst
        The case.
    about : About
        How the study was asked for.
    folder : str
        Of the study; "" where the command is run in it.

    Returns
    -------
    str
        For a shell.
    """
    seed = study.request.seed + found.sample
    place = f"{folder}/{file_name(found)}" if folder else file_name(found)
    fan = " --fan" if about.fan else ""
    return f"macromicro run {_quoted(about.programme)} --config {_quoted(place)} --seed {seed}{fan}"


def _quoted(text: str) -> str:
    import shlex

    return shlex.quote(text)


def remarks(study: Study) -> list[str]:
    """Say what must be known beside the numbers.

    Parameters
    ----------
    study : Study
        What was computed.

    Returns
    -------
    list of str
        A sentence each.
    """
    asked, done = study.request.samples, len(study.rows)
    found = []
    if study.interrupted:
        ran = int((~np.isnan(study.single[:, :, 0])).sum())
        found.append(
            f"INCOMPLETE: interrupted after {done} of {asked} machines of the sample and "
            f"{ran} of {study.single[:, :, 0].size - len(study.impossible)} runs of the tornado"
        )
    sample = study.sample
    if sample.refused:
        found.append(
            f"{sample.refused} combinations were drawn that no machine can be, and replaced; "
            f"the first: {sample.reason}"
        )
    found += [f"not run: {name}: {why}" for name, why in study.impossible.items()]
    return found


SPREAD_HEADINGS = (
    "metric",
    "known",
    "never",
    "least",
    *(f"{100 * level:g} %" for level in LEVELS),
    "most",
)


def spread_rows(study: Study) -> list[tuple[str, ...]]:
    """Give every metric's distribution over the sample.

    Parameters
    ----------
    study : Study
        What was computed.

    Returns
    -------
    list of tuple of str
        Under `SPREAD_HEADINGS`.
    """
    lines = []
    for column, metric in enumerate(QUANTITIES):
        s = spread(study.rows[:, column])
        values = [number(v) for v in (s.least, *s.quantiles, s.most)]
        unit = f" [{metric.unit}]" if metric.unit else ""
        lines.append((f"{metric.meaning}{unit}", str(s.known), str(s.never), *values))
    return lines
