"""The study in words: the same lines for terminal, page and files."""

from __future__ import annotations

import math
import shlex
from typing import NamedTuple

import numpy as np

from macromicro.robustness._findings import Influence, Worst, Yield, influences, yields
from macromicro.robustness.statistics import LEVELS, Rank, Share, spread
from macromicro.robustness.study import Study
from macromicro.uncertainty.ranges import FACTOR, VALUE
from macromicro.uncertainty.table import Uncertain

YIELD_HEADINGS = ("requirement", "limit", "nominal", "met", "yield", "95 % interval", "where known")


class About(NamedTuple):
    programme: str  # as on the command line; "" for the machine's usual moves
    title: str  # of the programme
    fan: bool  # whether a fan cooled the actuator
    started: str  # when
    seconds: float  # that it took
    overrides: dict[str, str]  # the settings that are not the defaults
    software: tuple[tuple[str, str], ...]  # name and version


def number(value: float, unit: str = "") -> str:
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "never"
    return f"{round(value, 3):.4g}{f' {unit}' if unit else ''}"


def rank(found: Rank, of: int) -> str:
    if math.isnan(found.value):
        return "-"
    text = f"{found.value:+.2f}"
    return text if found.significant(of) else f"({text})"


def percent(value: float) -> str:
    return "-" if math.isnan(value) else f"{100.0 * value:.1f} %"


def interval(found: Share) -> str:
    return f"{percent(found.low)} to {percent(found.high)}" if found.total else "-"


def yield_rows(study: Study, whole: Share) -> list[tuple[str, ...]]:
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
    """The parameters with the largest effect on a metric, without those of none."""
    return [i for i in influences(study, metric) if i.effect > 0.0][:count]


def influence(study: Study, metric: str) -> str:
    """The three strongest in words."""
    unit = study.metric(metric).unit
    parts = [
        f"{i.parameter.name} ({amount(i.parameter, i.parameter.low)}: {_end(i, i.low, unit)}, "
        f"{amount(i.parameter, i.parameter.high)}: {_end(i, i.high, unit)})"
        for i in top_influences(study, metric, 3)
    ]
    ran = int((~np.isnan(study.single[:, :, 0])).sum())
    return ", ".join(parts) or ("no varied parameter changes it" if ran else "not run")


def _end(i: Influence, value: float, unit: str) -> str:
    """The metric at one end; an end of infinite effect was stopped."""
    return "stopped" if math.isnan(value) and math.isinf(i.effect) else number(value, unit)


def amount(each: Uncertain, value: float) -> str:
    if each.kind == FACTOR:
        return f"{_with_sign(100.0 * (value - 1.0))} %"
    return f"{value:.3g} {each.unit}" if each.kind == VALUE else f"{_with_sign(value)} {each.unit}"


def _with_sign(value: float) -> str:
    return f"{value:+.3g}" if round(value, 9) else "0"


def worst_value(study: Study, found: Worst) -> str:
    metric = found.requirement.metric
    if not math.isinf(found.value):
        return number(found.value, metric.unit)
    s = spread(study.column(metric.name))
    return f"never; {s.never} of {s.known} never settled"


def file_name(found: Worst) -> str:
    return f"worst-{found.requirement.metric.name}.toml"


def replay(study: Study, found: Worst, about: About, folder: str) -> str:
    seed = study.request.seed + found.sample
    place = f"{folder}/{file_name(found)}" if folder else file_name(found)
    fan = " --fan" if about.fan else ""
    what = f"{shlex.quote(about.programme)} " if about.programme else ""
    return f"macromicro run {what}--config {shlex.quote(place)} --seed {seed}{fan}"


def remarks(study: Study) -> list[str]:
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
            f"{sample.refused} impossible combinations were drawn and replaced; "
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
    lines = []
    for metric in study.quantities:
        s = spread(study.column(metric.name))
        values = [number(v) for v in (s.least, *s.quantiles, s.most)]
        unit = f" [{metric.unit}]" if metric.unit else ""
        lines.append((f"{metric.meaning}{unit}", str(s.known), str(s.never), *values))
    return lines
