"""Tune a controller: search on the batch engine, then judge before and after on the bench."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.design.margins import Margins
from macromicro.settings import Settings
from macromicro.tuning import jobs, laws, loops, measuring, objectives, thesis
from macromicro.tuning.ensemble import Ensemble
from macromicro.tuning.evolution import minimise
from macromicro.tuning.measuring import Shown
from macromicro.tuning.objectives import Scale
from macromicro.tuning.request import Plan, Request, check

Progress = Callable[[int, float], None]

__all__ = [
    "Plan",
    "Request",
    "Searched",
    "Tuning",
    "check",
    "engine_costs",
    "judge",
    "macro",
    "micro",
    "prepare",
    "search",
    "tune",
]


class HeldOut(NamedTuple):
    """What fresh benches say, before and after.

    Attributes
    ----------
    costs, values : (float, float)
        With penalties, and the named objective alone, aggregated.
    cheaper : int
        On how many of the benches the tuned law costs less.
    """

    costs: tuple[float, float]
    values: tuple[float, float]
    cheaper: int


class Tuning(NamedTuple):
    """What a search gave; pairs are before and after.

    Attributes
    ----------
    plan : Plan
        That was followed.
    tuned : Settings
        With the new gains, the old ones where nothing better was found.
    evaluations : int
        That were made.
    engine_costs : (float, float)
        On the engine, aggregated over its benches.
    bench : (Shown, Shown)
        Runs on the full bench.
    bench_costs, bench_values : (float, float)
        What they cost with penalties, and what is named of it alone.
    robust_costs : (float, float) or None
        Over full benches of the ensemble that was searched on.
    held_out : HeldOut or None
        Over fresh ones.
    margins : (Margins, Margins) or None
        With the linear model (this package's macro laws).
    ripple_margins : (float, float) or None
        Measured (micro).
    history : tuple of float
        The least cost after each generation.
    trials : tuple of dict
        The thesis' route's sweeps.
    rejected : int
        Cheaper designs that were passed over (micro), see `loops.holds`.
    """

    plan: Plan
    tuned: Settings
    evaluations: int
    engine_costs: tuple[float, float]
    bench: tuple[Shown, Shown]
    bench_costs: tuple[float, float]
    bench_values: tuple[float, float]
    robust_costs: tuple[float, float] | None
    held_out: HeldOut | None
    margins: tuple[Margins, Margins] | None
    ripple_margins: tuple[float, float] | None
    history: tuple[float, ...]
    trials: tuple[dict[str, float | str], ...]
    rejected: int

    @property
    def better(self) -> bool:
        """Whether the named objective is less on the bench, or on fresh ones if it was tuned for
        an ensemble. Penalties have no say."""
        before, after = self.verdict
        return after < before

    @property
    def verdict(self) -> tuple[float, float]:
        """The named objective before and after, which judges the tuned law."""
        return self.bench_values if self.held_out is None else self.held_out.values


def tune(request: Request, progress: Progress = lambda done, best: None) -> Tuning:
    """Search and judge.

    Parameters
    ----------
    request : Request
        What is wanted.
    progress : callable
        Hears evaluations done and the least cost so far.

    Returns
    -------
    Tuning
        Before and after.

    Raises
    ------
    InputError
        The request cannot be met.
    """
    return judge(search(check(request), progress))


class Searched(NamedTuple):
    """A search's gains and what it took; the rest as in `Tuning`.

    Attributes
    ----------
    plan : Plan
        That was followed.
    gains : ndarray, shape (gains,)
        The best, in stored units.
    evaluations : int
        That were made.
    engine_costs : (float, float)
        Before and after.
    history : tuple of float
        The least cost after each generation.
    trials : tuple of dict
        The thesis' route's sweeps.
    rejected : int
        Cheaper designs that were passed over.
    """

    plan: Plan
    gains: Array
    evaluations: int
    engine_costs: tuple[float, float]
    history: tuple[float, ...]
    trials: tuple[dict[str, float | str], ...]
    rejected: int = 0


def prepare(plan: Plan) -> None:
    """Compile what the search needs, or load it from the cache, so that it need not wait.

    Parameters
    ----------
    plan : Plan
        To be followed.
    """
    engine_costs(plan)


def search(plan: Plan, progress: Progress = lambda done, best: None) -> Searched:
    """Search for the best gains by the plan's route.

    Parameters
    ----------
    plan : Plan
        To be followed.
    progress : callable
        Hears evaluations done and the least cost so far.

    Returns
    -------
    Searched
        Gains that are not judged yet.

    Raises
    ------
    InputError
        The thesis' route finds none.
    """
    costs = engine_costs(plan)
    present = laws.gains_of(plan.start.controller, plan.law)
    before = float(costs(present[None, :])[0])
    if plan.request.route == "thesis":
        taps, trials = thesis.tuned(progress, plan.start.controller)
        gains = np.array(taps)
        after = float(costs(gains[None, :])[0])
        return Searched(plan, gains, len(trials), (before, after), (), trials)
    law = plan.law
    found = minimise(
        lambda designs: costs(law.decoded(designs)),
        law.present(),
        plan.evaluations,
        plan.seed,
        jobs.unit(plan.engine) if plan.ensemble is None else 1,
        progress,
    )
    gains, cost, rejected = present, before, 0
    for design, least in zip(found.ranked, found.costs, strict=True):
        if not least < before:
            break
        tried = law.decoded(design[None, :])[0]
        if plan.request.stage == "macro" or _holds(plan, tried):
            gains, cost = tried, float(least)
            break
        rejected += 1
    return Searched(plan, gains, found.evaluations, (before, cost), found.history, (), rejected)


def _holds(plan: Plan, gains: Array) -> bool:
    """Whether the micro-stage keeps still with these gains."""
    control = laws.with_gains(plan.start.controller, plan.law, gains)
    return loops.holds(plan.start._replace(controller=control), plan.law)


def engine_costs(plan: Plan) -> Callable[[Array], Array]:
    """Make the function that is minimised.

    Parameters
    ----------
    plan : Plan
        To be followed.

    Returns
    -------
    callable
        Costs (n,) of gains (n, gains) on the plan's engine, over the ensemble if there is one.
    """
    each, ensemble = _each(plan, plan.engine, plan.ensemble), plan.ensemble
    return lambda gains: each(gains)[:, 0] if ensemble is None else ensemble.total(each(gains))


def _each(plan: Plan, engine: str, ensemble: Ensemble | None) -> Callable[[Array], Array]:
    """Costs (n, members) of gains (n, gains) on an engine."""
    metrics, scale = _metrics(plan, engine, ensemble)
    return lambda gains: objectives.costs(plan.objective, metrics(gains), scale)


def _metrics(
    plan: Plan, engine: str, ensemble: Ensemble | None
) -> tuple[Callable[[Array], dict[str, Array]], Scale]:
    """What makes metrics of gains on an engine, and the scale of their costs."""
    many = jobs.engine(engine, plan.start, plan.law, ensemble)
    first = many.metrics(laws.gains_of(plan.start.controller, plan.law)[None, :])
    return many.metrics, _scale(plan, first)


def _scale(plan: Plan, first: dict[str, Array]) -> Scale:
    """T0 of each bench of its own, (members,)."""
    bare = Scale(measuring.SECONDS, measuring.STEP, weights=plan.weights)
    return bare._replace(time=objectives.time_of(plan.request.stage, first, bare)[0])


def judge(found: Searched) -> Tuning:
    """Run before and after on the full bench, and give the margins.

    Parameters
    ----------
    found : Searched
        By `search`.

    Returns
    -------
    Tuning
        Before and after.
    """
    plan, start = found.plan, found.plan.start
    stage = plan.request.stage
    tuned = start._replace(controller=laws.with_gains(start.controller, plan.law, found.gains))
    run: Callable[[Settings], Shown] = measuring.macro if stage == "macro" else measuring.micro
    shown = (run(start), run(tuned))
    arrays = [{k: np.array([[v]]) for k, v in s.metrics.items()} for s in shown]
    scale = _scale(plan, arrays[0])
    robust, held_out = _robust(plan, tuned)
    margins = ripples = None
    if plan.law.field == laws.OWN:
        pass  # nothing is known of its linear part
    elif stage == "macro":
        margins = (loops.macro_margins(start.controller), loops.macro_margins(tuned.controller))
    else:
        ripples = (loops.ripple_margin(start, plan.law), loops.ripple_margin(tuned, plan.law))
    first, last = (float(objectives.costs(plan.objective, m, scale)[0, 0]) for m in arrays)
    was, now = (float(objectives.values(plan.objective, m, scale)[0, 0]) for m in arrays)
    return Tuning(
        plan,
        tuned,
        found.evaluations,
        found.engine_costs,
        shown,
        (first, last),
        (was, now),
        robust,
        held_out,
        margins,
        ripples,
        found.history,
        found.trials,
        found.rejected,
    )


def _robust(plan: Plan, tuned: Settings) -> tuple[tuple[float, float] | None, HeldOut | None]:
    """Costs before and after on full benches: those of the search, and fresh ones."""
    if plan.ensemble is None or plan.held_out is None:
        return None, None
    gains = np.stack([laws.gains_of(s.controller, plan.law) for s in (plan.start, tuned)])
    engine = f"{plan.request.stage}-bench"
    searched = plan.ensemble.total(_each(plan, engine, plan.ensemble)(gains))
    metrics, scale = _metrics(plan, engine, plan.held_out)
    fresh = metrics(gains)
    each = objectives.costs(plan.objective, fresh, scale)
    named = objectives.values(plan.objective, fresh, scale)
    held_out = HeldOut(
        _two(plan.held_out.total(each)),
        _two(plan.held_out.total(named)),
        int(np.sum(each[1] < each[0])),
    )
    return _two(searched), held_out


def _two(costs: Array) -> tuple[float, float]:
    before, after = costs
    return float(before), float(after)


def macro(**options: Any) -> Tuning:
    """Tune a law of the macro-stage.

    Parameters
    ----------
    **options : Any
        As in `Request`.

    Returns
    -------
    Tuning
        Before and after.
    """
    return tune(Request("macro", **options))


def micro(**options: Any) -> Tuning:
    """Tune a law of the micro-stage.

    Parameters
    ----------
    **options : Any
        As in `Request`.

    Returns
    -------
    Tuning
        Before and after.
    """
    return tune(Request("micro", **options))
