"""Gains of an axis by search: on the model that was found and on models drawn from what it is
uncertain by, within margins. No machine is looked at."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from macromicro.commission import axis_margins, comparing, margins, rehearsal
from macromicro.commission.model import Model
from macromicro.commission.procedure import Tuned
from macromicro.machines import machine as machines
from macromicro.machines import planning
from macromicro.machines.rotary import as_axis
from macromicro.machines.trial import Trial
from macromicro.schema.par import entries, value_at
from macromicro.tuning import stage

OBJECTIVE = "settling"
LEAST = 0.5  # distance of the loop from -1: a peak of its sensitivity of 2
_EVALUATIONS = 80
_LOOKED, _SPARE = (
    20,
    1.06,
)  # drawn models on which a design is looked at, and what more they ask for


def models(settings: Any, model: Model) -> Iterator[Any]:
    """Axes that the measurements leave possible, each with another friction before it slides.

    Parameters
    ----------
    settings : Any
        Of the machine that was found, as of an axis.
    model : Model
        Of strokes and chirp.

    Yields
    ------
    Any
        Settings.
    """
    others = list(rehearsal.drawn(settings))
    for one, other in zip(axis_margins.drawn(settings, model, len(others)), others, strict=True):
        friction = other.friction._replace(viscous=one.friction.viscous)
        yield one._replace(friction=friction)


def searched(
    settings: Any, model: Model, progress: Callable[[int, float], None] = lambda done, best: None
) -> Tuned:
    """Gains that settle sooner than those by the rules, where there are any.

    Moves are made on the model and on `models`; the worst counts. A design is allowed where its
    loop comes no nearer to -1 than `LEAST`, or than that of the rules, on any drawn model.

    Parameters
    ----------
    settings : Any
        Of the machine that was found, with gains by the rules and the tolerance of its rehearsal.
    model : Model
        Of strokes and chirp.
    progress : Callable[[int, float], None], optional
        Hears designs tried and the least cost; what it raises ends the search.

    Returns
    -------
    Tuned
        Nothing where the rules' gains are as good, or the law is another than `cascade`.
    """
    made = as_axis(settings)
    machine = machines.named("axis", "machine")
    if settings.law != machine.law.name:
        return Tuned()
    least = min(LEAST, axis_margins.robust(made, model).least.modulus)

    few = tuple(axis_margins.drawn(made, model, _LOOKED))  # gains do not change them

    def allowed(tree: Any) -> bool:
        return axis_margins.keeps(tree, model, few, _SPARE * least)

    objective = stage.named(OBJECTIVE)
    plan = planning.plan(rehearsal.programme(made), made)
    several = tuple(models(made, model))
    budget = stage.Budget(_EVALUATIONS, named=several, allowed=allowed)
    found = stage.search(machine, made, plan, objective, budget, progress)

    def worst(each: list[Trial]) -> float:
        return max(objective.value(t, 1e6 * made.arrival.tolerance) for t in each)

    before, after = worst(found.before), worst(found.after)
    if not comparing.better(after, before):
        return Tuned()
    if not axis_margins.keeps(
        found.tuned, model, axis_margins.drawn(made, model, margins.DRAWS), least
    ):
        return Tuned()
    return told(settings, found, before, after)


def told(settings: Any, found: stage.Tuning, before: float, after: float) -> Tuned:
    """The gains in the words of the machine.

    Parameters
    ----------
    settings : Any
        Of the machine, whose units count.
    found : stage.Tuning
        The search.
    before, after : float
        The objective on the worst model, s.

    Returns
    -------
    Tuned
        Gains as text with units, and lines for the page.
    """
    units = {e.path: e.par.unit for e in entries(settings)}
    paths = stage.knobs(found.machine, found.tuned)
    gains = {p: f'"{value_at(found.tuned, p)!r} {units[p]}"' for p in paths}
    rows = [("settling on the worst model", f"{after:.3g}", f"{before:.3g} by the rules", "s")]
    for path in paths:
        rule = f"{value_at(settings, path):.4g} by the rules"
        rows.append((path, f"{value_at(found.tuned, path):.4g}", rule, units[path]))
    return Tuned(gains, tuple(rows))
