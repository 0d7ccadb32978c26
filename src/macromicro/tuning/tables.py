"""A tuning in words and numbers: the table before and after, and what to say of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from macromicro.schema.par import entries
from macromicro.tuning.laws import OWN
from macromicro.tuning.loops import LEAST, MOST
from macromicro.tuning.objectives import described
from macromicro.tuning.tune import Tuning

_MACRO = (
    ("settling_time", "settling into 2 %", "s"),
    ("rise_time", "rise to 98 %", "s"),
    ("overshoot", "overshoot", "counts"),
    ("reversals", "reversals after arrival", ""),
    ("iae", "integral of |error|", "counts s"),
    ("final_error", "error at the end", "counts"),
    ("peak_effort", "peak effort asked for", "V"),
    ("saturated", "samples saturated", ""),
)
_MICRO = (
    ("settle_up", "settling up into 10 um", "s"),
    ("settle_down", "settling down into 10 um", "s"),
    ("overshoot", "overshoot", "um"),
    ("worst_error", "worst error at rest", "um"),
    ("iae", "integral of |error|", "mm s"),
    ("saturated", "share saturated", ""),
)
_MARGINS = (
    ("gain", "gain margin (factor)", ""),
    ("phase", "phase margin", "deg"),
    ("crossover", "at", "rad/s"),
    ("delay", "delay margin", "s"),
    ("disk", "disk margin alpha", ""),
    ("disk_gain", "its gain margin (factor)", ""),
    ("disk_phase", "its phase margin", "deg"),
)


class Line(NamedTuple):
    """A row of the table.

    Attributes
    ----------
    name : str
        What.
    before, after : float
        In `unit`.
    unit : str
        For a person.
    """

    name: str
    before: float
    after: float
    unit: str


def measured(found: Tuning) -> list[Line]:
    """Give the metrics on the bench, and the cost there.

    Parameters
    ----------
    found : Tuning
        What was found.

    Returns
    -------
    list of Line
        For the table.
    """
    lines, objective = _metrics(found), found.plan.objective
    lines.append(Line(f"objective ({objective.name})", *found.bench_values, objective.unit))
    lines.append(Line("with penalties", *found.bench_costs, objective.unit))
    plan = found.plan
    for ensemble, costs, which in (
        (plan.ensemble, found.robust_costs, "searched"),
        (plan.held_out, found.held_out and found.held_out.costs, "fresh"),
    ):
        if ensemble is not None and costs is not None:
            words = "worst" if ensemble.aggregate == "worst" else "95 %"
            name = f"with penalties, {words} of {len(ensemble.draws)} {which}"
            lines.append(Line(name, *costs, objective.unit))
    return lines


def _metrics(found: Tuning) -> list[Line]:
    first, last = (shown.metrics for shown in found.bench)
    names = _MACRO if found.plan.request.stage == "macro" else _MICRO
    return [Line(words, first[key], last[key], unit) for key, words, unit in names]


def bounds(found: Tuning) -> list[Line]:
    """Give the margins with the linear model; for the micro-stage the one that was measured.

    Parameters
    ----------
    found : Tuning
        What was found.

    Returns
    -------
    list of Line
        For the table.
    """
    if found.margins is not None:
        first, last = found.margins
        return [
            Line(words, getattr(first, k), getattr(last, k), unit) for k, words, unit in _MARGINS
        ]
    if found.ripple_margins is None:
        return []
    return [Line("ripple margin (factor)", *found.ripple_margins, "")]


def gains(found: Tuning) -> list[Line]:
    """Give the law's gains.

    Parameters
    ----------
    found : Tuning
        What was found.

    Returns
    -------
    list of Line
        For the table.
    """
    law, pair = found.plan.law, (found.plan.start, found.tuned)
    sets = [getattr(s.controller, law.field) for s in pair]
    pars = {e.path: e.par for e in entries(sets[0])}

    def line(gain: str) -> Line:
        before, after = (pars[gain].given(getattr(s, gain)) for s in sets)
        return Line(gain, before, after, pars[gain].read_in)

    return [line(gain) for gain in law.gains]


def text(found: Tuning) -> Iterator[str]:
    """Put a tuning into plain text.

    Parameters
    ----------
    found : Tuning
        What was found.

    Yields
    ------
    str
        A line.
    """
    blocks = (
        ("gains", gains(found)),
        ("on the bench", measured(found)),
        ("margins", bounds(found)),
    )
    for title, lines in blocks:
        if not lines:
            continue
        yield f"{title:34}{'before':>14}{'after':>14}"
        for each in lines:
            yield f"  {each.name:32}{_number(each.before):>14}{_number(each.after):>14} {each.unit}"
    yield ""
    yield from remarks(found)


def remarks(found: Tuning) -> Iterator[str]:
    """Say how the search went, and whether it was any good.

    Parameters
    ----------
    found : Tuning
        What was found.

    Yields
    ------
    str
        A sentence.
    """
    plan = found.plan
    before, after = found.engine_costs
    if plan.request.route != "thesis":
        yield f"Minimised: {described(plan.objective, plan.weights)}."
    yield (
        f"{found.evaluations} {'trials' if plan.request.route == 'thesis' else 'evaluations'} on "
        f"{plan.engine}: cost {_number(before)} to {_number(after)} {plan.objective.unit}"
    )
    if plan.request.stage == "micro":
        yield (
            "The micro-stage has no linear model, so gain, phase and disk margins are not "
            "defined. Its ripple margin is the largest factor on all gains at which a hold at "
            f"2 mm stays within 10 um on the bench; {MOST:g} is the largest tried."
        )
    if plan.law.field == OWN:
        yield f"Nothing is known of a linear part of {plan.law.name}: it has no margins here."
    if found.rejected:
        yield (
            f"Cheaper designs passed over: {found.rejected}, whose ripple margin was below "
            f"{LEAST:g}."
        )
    first, last = found.verdict
    where = "on the bench" if found.held_out is None else "on fresh benches"
    name, unit = plan.objective.name, plan.objective.unit.replace("1", "")
    figures = f"{name} {_number(first)} to {_number(last)} {unit}".strip()
    if found.better:
        yield f"The tuned law is better {where}: {figures}."
    elif last == first:
        yield f"The tuned law is not better {where}: {name} is the same, {_number(first)} {unit}."
    else:
        yield f"The tuned law is not better {where}: {figures}."
    was, now = found.bench_costs if found.held_out is None else found.held_out.costs
    if found.better and now > was:
        yield f"With its penalties it costs more there: {_number(was)} to {_number(now)}."
    if found.held_out is not None and plan.held_out is not None:
        yield (
            f"It costs less on {found.held_out.cheaper} of {len(plan.held_out.draws)} benches that "
            "the search has not seen."
        )
    worse = [line for line in _metrics(found) if _worse(line)]
    if worse:
        yield f"Worse on the bench than before: {'; '.join(_change(x) for x in worse)}."


def _worse(line: Line) -> bool:
    """Larger than before, or (NaN) not reached any more."""
    if math.isnan(line.after):
        return not math.isnan(line.before)
    return abs(line.after) > abs(line.before)


def _change(line: Line) -> str:
    after = "no value" if math.isnan(line.after) else f"{_number(line.after)} {line.unit}"
    return f"{line.name} {_number(line.before)} to {after}".strip()


def _number(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "inf" if math.isinf(value) else f"{value:.5g}"
