"""Tune a controller: search on the batch engine, then judge before and after on the bench."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.design.margins import Margins
from macromicro.settings import Settings
from macromicro.tuning import _laws, _measuring, _objectives, loops, thesis
from macromicro.tuning._engine import Engine
from macromicro.tuning._ensemble import Ensemble
from macromicro.tuning._measuring import Shown
from macromicro.tuning._objectives import Scale
from macromicro.tuning._request import Plan, Request, check
from macromicro.tuning.evolution import minimise

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
    """Costs on fresh benches, before and after."""

    costs: tuple[float, float]  # the objective with its penalties, aggregated
    cheaper: int  # on how many of the benches the tuned law costs less


class Tuning(NamedTuple):
    """Result of a search; pairs are before and after."""

    plan: Plan  #: that was followed
    tuned: Settings  #: with the new gains, the old ones where nothing better was found
    evaluations: int  #: that were made
    engine_costs: tuple[float, float]  #: on the engine, aggregated over its benches
    bench: tuple[Shown, Shown]  #: runs on the full bench
    #: bench_costs, bench_values: what they cost with penalties, and what is named of it alone
    bench_costs: tuple[float, float]
    bench_values: tuple[float, float]
    #: over full benches of the ensemble that was searched on
    robust_costs: tuple[float, float] | None
    held_out: HeldOut | None  #: over fresh ones
    margins: tuple[Margins, Margins] | None  #: with the linear model (this package's macro laws)
    ripple_margins: tuple[float, float] | None  #: measured (micro)
    history: tuple[float, ...]  #: the least cost after each generation
    trials: tuple[dict[str, float | str], ...]  #: the thesis' route's sweeps
    rejected: int  #: cheaper designs that were passed over (micro), see `loops.holds`

    @property
    def better(self) -> bool:
        """Whether the minimised cost is less on the bench, or on fresh ones for an ensemble."""
        before, after = self.verdict
        return after < before

    @property
    def verdict(self) -> tuple[float, float]:
        """The objective with its penalties before and after, which judges the tuned law."""
        return self.bench_costs if self.held_out is None else self.held_out.costs


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
    """A search's gains and effort; the rest as in `Tuning`."""

    plan: Plan  # that was followed
    gains: Array  # the best, in stored units
    evaluations: int  # that were made
    engine_costs: tuple[float, float]  # before and after
    history: tuple[float, ...]  # the least cost after each generation
    trials: tuple[dict[str, float | str], ...]  # the thesis' route's sweeps
    rejected: int = 0  # cheaper designs that were passed over


def prepare(plan: Plan) -> None:
    """Compile the search's kernels, or load them from the cache."""
    engine_costs(plan)


def search(plan: Plan, progress: Progress = lambda done, best: None) -> Searched:
    costs = engine_costs(plan)
    present = _laws.gains_of(plan.start.controller, plan.law)
    before = float(costs(present[None, :])[0])
    if plan.request.route == "thesis":
        taps, trials = thesis.tuned(progress, plan.start.controller)
        gains = plan.law.rounded(np.array([taps]))[0]
        after = float(costs(gains[None, :])[0])
        return Searched(plan, gains, len(trials), (before, after), (), trials)
    law = plan.law
    found = minimise(
        lambda designs: costs(law.rounded(law.decoded(designs))),
        law.present(),
        plan.evaluations,
        plan.seed,
        progress,
    )
    gains, cost, rejected = present, before, 0
    for design, least in zip(found.ranked, found.costs, strict=True):
        if not least < before:
            break
        tried = law.rounded(law.decoded(design[None, :]))[0]
        if plan.request.stage == "macro" or _holds(plan, tried):
            gains, cost = tried, float(least)
            break
        rejected += 1
    return Searched(plan, gains, found.evaluations, (before, cost), found.history, (), rejected)


def _holds(plan: Plan, gains: Array) -> bool:
    """Whether the micro-stage's ripple stays within the band with these gains."""
    control = _laws.with_gains(plan.start.controller, plan.law, gains)
    return loops.holds(plan.start._replace(controller=control), plan.law)


def engine_costs(plan: Plan) -> Callable[[Array], Array]:
    each, ensemble = _each(plan, plan.ensemble), plan.ensemble
    return lambda gains: each(gains)[:, 0] if ensemble is None else ensemble.total(each(gains))


def _each(plan: Plan, ensemble: Ensemble | None) -> Callable[[Array], Array]:
    """Costs (n, members) of gains (n, gains)."""
    metrics, scale = _metrics(plan, ensemble)
    return lambda gains: _objectives.costs(plan.objective, metrics(gains), scale)


def _metrics(
    plan: Plan, ensemble: Ensemble | None
) -> tuple[Callable[[Array], dict[str, Array]], Scale]:
    """A function from gains to metrics, and the scale of their costs."""
    from macromicro import batch

    members = () if ensemble is None else ensemble.on_bench()
    many = Engine(batch.job(plan.engine, settings=plan.start), plan.law.paths, *members)
    first = many.metrics(_laws.gains_of(plan.start.controller, plan.law)[None, :])
    return many.metrics, _scale(plan, first)


def _scale(plan: Plan, first: dict[str, Array]) -> Scale:
    """T0 of each bench, (members,)."""
    bare = Scale(_measuring.SECONDS, _measuring.STEP, weights=plan.weights)
    return bare._replace(time=_objectives.time_of(plan.request.stage, first, bare)[0])


def judge(found: Searched) -> Tuning:
    """Run before and after on the full bench, and compute the margins."""
    plan, start = found.plan, found.plan.start
    stage = plan.request.stage
    tuned = start._replace(controller=_laws.with_gains(start.controller, plan.law, found.gains))
    run: Callable[[Settings], Shown] = _measuring.macro if stage == "macro" else _measuring.micro
    shown = (run(start), run(tuned))
    arrays = [{k: np.array([[v]]) for k, v in s.metrics.items()} for s in shown]
    scale = _scale(plan, arrays[0])
    robust, held_out = _robust(plan, tuned)
    margins = ripples = None
    if plan.law.field == _laws.OWN:
        pass  # nothing is known of its linear part
    elif stage == "macro":
        margins = (loops.macro_margins(start.controller), loops.macro_margins(tuned.controller))
    else:
        ripples = (loops.ripple_margin(start, plan.law), loops.ripple_margin(tuned, plan.law))
    first, last = (float(_objectives.costs(plan.objective, m, scale)[0, 0]) for m in arrays)
    was, now = (float(_objectives.values(plan.objective, m, scale)[0, 0]) for m in arrays)
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
    gains = np.stack([_laws.gains_of(s.controller, plan.law) for s in (plan.start, tuned)])
    searched = plan.ensemble.total(_each(plan, plan.ensemble)(gains))
    metrics, scale = _metrics(plan, plan.held_out)
    each = _objectives.costs(plan.objective, metrics(gains), scale)
    held_out = HeldOut(_two(plan.held_out.total(each)), int(np.sum(each[1] < each[0])))
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
