"""A tuning as a table and remarks: the same for terminal, page and files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from macromicro.tuning.search import Tuning
from macromicro.tuning.subject import Margin, has_failed

GAINS, RUN, COST, MARGINS = "gains", "figures of the run", "objective", "margins"


class Row(NamedTuple):
    group: str
    name: str  # short, as files have it
    meaning: str
    values: tuple[float, ...]  # of each version
    unit: str


def rows(found: Tuning, margins: Sequence[Sequence[Margin]]) -> list[Row]:
    """The table; `margins`: of each version."""
    return [*_gains(found), *_figures(found), *_costs(found), *_margins(margins)]


def _gains(found: Tuning) -> Iterator[Row]:
    each = [found.subject.gains(version.settings) for version in found.versions]
    for path in found.subject.paths:
        unit = each[0][path][1]
        yield Row(GAINS, path, path, tuple(gains[path][0] for gains in each), unit)


def _figures(found: Tuning) -> Iterator[Row]:
    for metric in found.subject.metrics:
        values = tuple(version.runs[0][metric.name] for version in found.versions)
        yield Row(RUN, metric.name, metric.meaning, values, metric.unit)


def _costs(found: Tuning) -> Iterator[Row]:
    objective, unit = found.objective, found.objective.unit
    first = found.first.runs[0]
    values = tuple(objective.value(version.runs[0]) for version in found.versions)
    whole = tuple(
        objective.cost(version.runs[0], first, found.weights) for version in found.versions
    )
    added = tuple(total - value for total, value in zip(whole, values, strict=True))
    yield Row(COST, "value", objective.name, values, unit)
    yield Row(COST, "penalties", "and its penalties", added, unit)
    yield Row(COST, "cost", "objective, the sum of both", whole, unit)
    count = len(found.first.runs)
    if count > 1:
        worst = tuple(version.cost for version in found.versions)
        yield Row(COST, "searched", f"objective, worst of {count} searched", worst, unit)


def _margins(margins: Sequence[Sequence[Margin]]) -> Iterator[Row]:
    for each in zip(*margins, strict=True):
        values = tuple(margin.value for margin in each)
        yield Row(MARGINS, each[0].name, each[0].meaning, values, each[0].unit)


def text(found: Tuning, table: Sequence[Row], remarks: Sequence[str]) -> Iterator[str]:
    """The lines for the terminal."""
    group = ""
    for row in table:
        if row.group != group:
            group = row.group
            yield f"{group:66}" + "".join(f"{version.name:>13}" for version in found.versions)
        digits = 8 if group == GAINS else 5
        values = "".join(f"{number(value, digits):>13}" for value in row.values)
        yield f"  {row.meaning:64}{values} {row.unit}".rstrip()
    yield ""
    yield from remarks


def remarks(found: Tuning) -> Iterator[str]:
    subject, objective = found.subject, found.objective
    yield f"Minimised: {objective.described(found.weights)}."
    yield f"{found.evaluations} designs were tried, seed {found.budget.seed}."
    yield from subject.remarks
    if found.rejected:
        yield f"Rejected cheaper designs: {found.rejected}, which do not stay quiet."
    before, after = found.verdict
    where = "" if found.fresh is None else " on fresh machines"
    figures = f"objective {number(before)} to {number(after)} {objective.unit}".strip()
    if found.better:
        yield f"The tuned gains are better{where}: {figures}."
    elif found.best is found.first:
        yield "No design was better than the start, whose gains stay."
    else:
        yield f"The tuned gains are not better{where}: {figures}."
    yield from _on_fresh(found)
    yield from _worse(found)
    yield from subject.doubts(found.best.settings, found.best.runs[0])


def _on_fresh(found: Tuning) -> Iterator[str]:
    if found.fresh is None:
        return
    before, after = found.fresh.runs
    count = len(before)
    yield f"They cost less on {found.fresh.cheaper} of {count} fresh machines."
    failed = [sum(map(has_failed, runs)) for runs in (before, after)]
    if any(failed):
        yield (
            f"Fresh machines with a fault or without arrival: {failed[0]} of {count} before, "
            f"{failed[1]} after."
        )


def _worse(found: Tuning) -> Iterator[str]:
    """Figures that have become larger, or are no longer reached (NaN)."""
    first, best = found.first.runs[0], found.best.runs[0]
    changes = []
    for metric in found.subject.metrics:
        before, after = first[metric.name], best[metric.name]
        worse = not math.isnan(before) if math.isnan(after) else abs(after) > abs(before)
        if worse:
            now = "no value" if math.isnan(after) else f"{number(after)} {metric.unit}".strip()
            changes.append(f"{metric.meaning} {number(before)} to {now}")
    if changes:
        yield f"Worse than before: {'; '.join(changes)}."


def number(value: float, digits: int = 5) -> str:
    if math.isnan(value):
        return "-"
    return "never" if math.isinf(value) else f"{value:.{digits}g}"
