"""Search for an axis' gains on the identified model and its uncertainty, within margins."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from macromicro.commission import _axis_margins, _comparing, _rehearsal, margins
from macromicro.commission._axis_fit import Model
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
    """Axes within the uncertainty, with different presliding friction."""
    others = list(_rehearsal.drawn(settings))
    for one, other in zip(_axis_margins.drawn(settings, model, len(others)), others, strict=True):
        friction = other.friction._replace(viscous=one.friction.viscous)
        yield one._replace(friction=friction)


def searched(
    settings: Any, model: Model, progress: Callable[[int, float], None] = lambda done, best: None
) -> Tuned:
    """Gains that settle faster than those by the rules, if any."""
    # The slowest move over the model and `models` counts. A design is feasible if its modulus
    # margin is at least `LEAST`, or that of the rules, on any drawn model.
    made = as_axis(settings)
    machine = machines.named("axis", "machine")
    if settings.law != machine.law.name:
        return Tuned()
    least = min(LEAST, _axis_margins.robust(made, model).least.modulus)

    few = tuple(_axis_margins.drawn(made, model, _LOOKED))  # gains do not change them

    def allowed(tree: Any) -> bool:
        return _axis_margins.keeps(tree, model, few, _SPARE * least)

    objective = stage.named(OBJECTIVE)
    plan = planning.plan(_rehearsal.programme(made), made)
    several = tuple(models(made, model))
    budget = stage.Budget(_EVALUATIONS, named=several, allowed=allowed)
    found = stage.search(machine, made, plan, objective, budget, progress)

    def worst(each: list[Trial]) -> float:
        return max(objective.value(t, 1e6 * made.arrival.tolerance) for t in each)

    before, after = worst(found.before), worst(found.after)
    if not _comparing.better(after, before):
        return Tuned()
    if not _axis_margins.keeps(
        found.tuned, model, _axis_margins.drawn(made, model, margins.DRAWS), least
    ):
        return Tuned()
    return told(settings, found, before, after)


def told(settings: Any, found: stage.Tuning, before: float, after: float) -> Tuned:
    units = {e.path: e.par.unit for e in entries(settings)}
    paths = stage.knobs(found.machine, found.tuned)
    gains = {p: f'"{value_at(found.tuned, p)!r} {units[p]}"' for p in paths}
    rows = [("settling on the worst model", f"{after:.3g}", f"{before:.3g} s by the rules", "s")]
    for path in paths:
        rule = f"{value_at(settings, path):.4g} {units[path]} by the rules"
        rows.append((path, f"{value_at(found.tuned, path):.4g}", rule, units[path]))
    return Tuned(gains, tuple(rows))
