"""A tuning in words and numbers: the table before and after, and remarks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from macromicro.schema.par import entries
from macromicro.tuning._laws import DIGITS, OWN
from macromicro.tuning._objectives import described
from macromicro.tuning.loops import LEAST, MOST
from macromicro.tuning.tune import Tuning

_MACRO = (
    ("settling_time", "settling into 2 %", "s"),
    ("rise_time", "rise to 98 %", "s"),
    ("overshoot", "overshoot", "counts"),
    ("reversals", "reversals after arrival", ""),
    ("iae", "integral of |error|", "counts s"),
    ("final_error", "error at the end", "counts"),
    ("peak_effort", "peak effort requested", "V"),
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
    name: str
    # before, after: in `unit`
    before: float
    after: float
    unit: str  # for a person


def measured(found: Tuning) -> list[Line]:
    lines, objective = _metrics(found), found.plan.objective
    (before, after), (first, last) = found.bench_costs, found.bench_values
    lines.append(Line(objective.name, *found.bench_values, objective.unit))
    lines.append(Line("and its penalties", before - first, after - last, objective.unit))
    lines.append(Line("objective, the sum of both", *found.bench_costs, objective.unit))
    plan = found.plan
    for ensemble, costs, which in (
        (plan.ensemble, found.robust_costs, "searched"),
        (plan.held_out, found.held_out and found.held_out.costs, "fresh"),
    ):
        if ensemble is not None and costs is not None:
            words = "worst" if ensemble.aggregate == "worst" else "95 %"
            name = f"objective, {words} of {len(ensemble.draws)} {which}"
            lines.append(Line(name, *costs, objective.unit))
    return lines


def _metrics(found: Tuning) -> list[Line]:
    first, last = (shown.metrics for shown in found.bench)
    names = _MACRO if found.plan.request.stage == "macro" else _MICRO
    return [Line(words, first[key], last[key], unit) for key, words, unit in names]


def bounds(found: Tuning) -> list[Line]:
    """Margins with the linear model, or the measured one of the micro-stage."""
    if found.margins is not None:
        first, last = found.margins
        return [
            Line(words, getattr(first, k), getattr(last, k), unit) for k, words, unit in _MARGINS
        ]
    if found.ripple_margins is None:
        return []
    return [Line("ripple margin (factor)", *found.ripple_margins, "")]


def gains(found: Tuning) -> list[Line]:
    law, pair = found.plan.law, (found.plan.start, found.tuned)
    sets = [getattr(s.controller, law.field) for s in pair]
    pars = {e.path: e.par for e in entries(sets[0])}

    def line(gain: str) -> Line:
        before, after = (pars[gain].given(getattr(s, gain)) for s in sets)
        return Line(gain, before, after, pars[gain].read_in)

    return [line(gain) for gain in law.gains]


def text(found: Tuning) -> Iterator[str]:
    blocks = (
        ("gains", gains(found)),
        ("on the bench", measured(found)),
        ("margins", bounds(found)),
    )
    for title, lines in blocks:
        if not lines:
            continue
        digits = DIGITS if title == "gains" else 5
        yield f"{title:34}{'before':>14}{'after':>14}"
        for each in lines:
            values = "".join(f"{_number(x, digits):>14}" for x in (each.before, each.after))
            yield f"  {each.name:32}{values} {each.unit}"
    yield ""
    yield from remarks(found)


def remarks(found: Tuning) -> Iterator[str]:
    plan = found.plan
    if plan.request.route != "thesis":
        yield f"Minimised: {described(plan.objective, plan.weights)}."
    yield (
        f"{found.evaluations} {'trials' if plan.request.route == 'thesis' else 'evaluations'} on "
        f"{plan.engine}."
    )
    if plan.request.stage == "micro":
        yield (
            "The micro-stage has no linear model, so gain, phase and disk margins are not "
            "defined. Its ripple margin is the largest factor on all gains at which a hold at "
            f"2 mm stays within 10 um on the bench; {MOST:g} is the largest tried."
        )
    if plan.law.field == OWN:
        yield f"{plan.law.name} has no known linear part, so no margins."
    if found.rejected:
        yield (f"Rejected cheaper designs: {found.rejected}, with a ripple margin below {LEAST:g}.")
    first, last = found.verdict
    where = "on the bench" if found.held_out is None else "on fresh benches"
    unit = plan.objective.unit.replace("1", "")
    figures = f"objective {_number(first)} to {_number(last)} {unit}".strip()
    if found.better:
        yield f"The tuned law is better {where}: {figures}."
    elif last == first:
        same = f"the objective is the same, {_number(first)} {unit}"
        yield f"The tuned law is not better {where}: {same}."
    else:
        yield f"The tuned law is not better {where}: {figures}."
    yield from _beyond(found)
    if found.held_out is not None and plan.held_out is not None:
        yield (
            f"Its cost is lower on {found.held_out.cheaper} of {len(plan.held_out.draws)} "
            "fresh benches."
        )
    worse = [line for line in _metrics(found) if _worse(line)]
    if worse:
        yield f"Worse on the bench than before: {'; '.join(_change(x) for x in worse)}."


def _beyond(found: Tuning) -> Iterator[str]:
    """A remark where the tuned macro law requests more than the limit."""
    asked = found.bench[1].metrics.get("peak_effort", 0.0)
    limit = found.plan.start.controller.motor_limit
    if asked > limit:
        samples = found.bench[1].metrics["saturated"]
        yield (
            f"The law requests up to {_number(asked)} V, but the limit is {limit:g} V: it "
            f"saturates for {samples:.0f} samples after the first. --penalty saturated=0.01 "
            "searches for gains that avoid this."
        )


def _worse(line: Line) -> bool:
    """Larger than before, or no longer reached (NaN)."""
    if math.isnan(line.after):
        return not math.isnan(line.before)
    return abs(line.after) > abs(line.before)


def _change(line: Line) -> str:
    after = "no value" if math.isnan(line.after) else f"{_number(line.after)} {line.unit}"
    return f"{line.name} {_number(line.before)} to {after}".strip()


def _number(value: float, digits: int = 5) -> str:
    if math.isnan(value):
        return "-"
    return "inf" if math.isinf(value) else f"{value:.{digits}g}"
