"""Tune a controller: search on the batch engine, then judge before and after on the bench."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.design.margins import Margins
from macromicro.errors import InputError
from macromicro.settings import Settings
from macromicro.textfile import printable
from macromicro.tuning import ensemble as ensembles
from macromicro.tuning import jobs, laws, loops, measuring, objectives, thesis
from macromicro.tuning.ensemble import Ensemble
from macromicro.tuning.evolution import minimise
from macromicro.tuning.laws import Law
from macromicro.tuning.measuring import Shown
from macromicro.tuning.objectives import Objective, Scale

Array = npt.NDArray[np.float64]
Tell = Callable[[int, float], None]

STAGES = ("macro", "micro")
ROUTES = ("optimise", "thesis")
ENGINES = ("model", "bench")
MOST = 10_000_000
MAX_SEED = 2**31


class Request(NamedTuple):
    """What is wanted. `law`: by default the settings' own; `on`: model or bench, by default
    the model where it has the law; `aggregate` and `benches` of the ensemble, if `robust`;
    `saturate`: the macro effort may saturate after its first sample at no cost."""

    stage: str
    objective: str = "settling"
    law: str | None = None
    evaluations: int = 300
    seed: int = 0
    settings: Settings = Settings()
    on: str | None = None
    route: str = "optimise"
    robust: bool = False
    aggregate: str = "worst"
    benches: int = 16
    saturate: bool = False


class Plan(NamedTuple):
    """A request that was found good. `engine`: a job's name; `start`: the settings with the
    law chosen; `ensemble` for a robust search."""

    request: Request
    law: Law
    objective: Objective
    engine: str
    start: Settings
    ensemble: Ensemble | None


class Tuning(NamedTuple):
    """What a search gave; pairs are before and after.

    `tuned`: settings with the new gains, the old ones where nothing better was found.
    `engine_costs`: on the engine, aggregated over its benches; `bench`: runs on the full
    bench, `bench_costs` what they cost; `robust_costs`: aggregated over the ensemble of
    full benches. `margins` with the linear model (macro), `ripple_margins`: measured (micro).
    `history`: the least cost after each generation; `trials`: the thesis' route's sweeps;
    `rejected`: cheaper designs that were passed over (micro), see `loops.holds`.
    """

    plan: Plan
    tuned: Settings
    evaluations: int
    engine_costs: tuple[float, float]
    bench: tuple[Shown, Shown]
    bench_costs: tuple[float, float]
    robust_costs: tuple[float, float] | None
    margins: tuple[Margins, Margins] | None
    ripple_margins: tuple[float, float] | None
    history: tuple[float, ...]
    trials: tuple[dict[str, float | str], ...]
    rejected: int

    @property
    def better(self) -> bool:
        """Whether the tuned law costs less on the bench, by the ensemble if there is one."""
        before, after = self.robust_costs or self.bench_costs
        return after < before


def check(request: Request) -> Plan:
    """Everything that can be wrong with a request is said here. Raises `InputError`."""
    stage = request.stage
    _one_of("stage", stage, STAGES)
    _one_of("--route", request.route, ROUTES)
    if request.on is not None:
        _one_of("--on", request.on, ENGINES)
    objective = objectives.find(stage, request.objective)
    law = laws.find(stage, request.law, request.settings.controller)
    if not 1 <= request.evaluations <= MOST:
        raise InputError("--evaluations", request.evaluations, f"a whole number from 1 to {MOST}")
    if not 0 <= request.seed < MAX_SEED:
        raise InputError("--seed", request.seed, f"a whole number from 0 to {MAX_SEED - 1}")
    modelled = stage == "macro" and law.name in jobs.MODELLED
    if request.on == "model" and not modelled:
        raise InputError(
            "--on", "model", f"bench for {law.name}: the model's batch has {jobs.MODELLED_WORDS}"
        )
    if request.route == "thesis":
        if not modelled:
            raise InputError(
                "--route",
                "thesis",
                f"optimise for {stage} {law.name}: the thesis "
                "tunes the macro-stage's PD in this way",
            )
        if request.robust:
            raise InputError("--robust", "with --route thesis", "--route optimise")
    present = laws.gains_of(request.settings.controller, law)
    control = laws.with_gains(request.settings.controller, law, present)
    start = request.settings._replace(controller=control)
    ensemble = None
    if request.robust:
        ensemble = ensembles.draw(stage, start, request.benches, request.aggregate, request.seed)
    on_model = modelled and request.on != "bench"
    return Plan(
        request, law, objective, f"{stage}-{'model' if on_model else 'bench'}", start, ensemble
    )


def _one_of(where: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InputError(where, printable(value), f"one of {', '.join(known)}")


def tune(request: Request, tell: Tell = lambda done, best: None) -> Tuning:
    """Search and judge; `tell` hears evaluations done and the least cost so far.

    Raises `InputError` for a request that cannot be met.
    """
    return judge(search(check(request), tell))


class Searched(NamedTuple):
    """A search's gains and what it took: see `Tuning`."""

    plan: Plan
    gains: Array
    evaluations: int
    engine_costs: tuple[float, float]
    history: tuple[float, ...]
    trials: tuple[dict[str, float | str], ...]
    rejected: int = 0


def prepare(plan: Plan) -> None:
    """Compile what the search needs, or load it from the cache, so that it need not wait."""
    engine_costs(plan)


def search(plan: Plan, tell: Tell = lambda done, best: None) -> Searched:
    """The best gains by the plan's route."""
    costs = engine_costs(plan)
    present = laws.gains_of(plan.start.controller, plan.law)
    before = float(costs(present[None, :])[0])
    if plan.request.route == "thesis":
        taps, trials = thesis.tuned(tell)
        gains = np.array(taps)
        after = float(costs(gains[None, :])[0])
        return Searched(plan, gains, len(trials), (before, after), (), trials)
    law, request = plan.law, plan.request
    found = minimise(
        lambda designs: costs(law.decoded(designs)),
        law.present(),
        request.evaluations,
        request.seed,
        jobs.unit(plan.engine) if plan.ensemble is None else 1,
        tell,
    )
    gains, cost, rejected = present, before, 0
    for design, least in zip(found.ranked, found.costs, strict=True):
        if not least < before:
            break
        tried = law.decoded(design[None, :])[0]
        if request.stage == "macro" or _holds(plan, tried):
            gains, cost = tried, float(least)
            break
        rejected += 1
    return Searched(plan, gains, found.evaluations, (before, cost), found.history, (), rejected)


def _holds(plan: Plan, gains: Array) -> bool:
    """Whether the micro-stage keeps still with these gains."""
    control = laws.with_gains(plan.start.controller, plan.law, gains)
    return loops.holds(plan.start._replace(controller=control), plan.law)


def engine_costs(plan: Plan, engine: str | None = None) -> Callable[[Array], Array]:
    """Costs (n,) of gains (n, gains) on the plan's engine or another, over the ensemble if
    there is one."""
    many = jobs.engine(engine or plan.engine, plan.start, plan.law, plan.ensemble)
    first = many.metrics(laws.gains_of(plan.start.controller, plan.law)[None, :])
    scale = _scale(plan, first)

    def costs(gains: Array) -> Array:
        each = objectives.costs(plan.objective, many.metrics(gains), scale)
        return each[:, 0] if plan.ensemble is None else plan.ensemble.total(each)

    return costs


def _scale(plan: Plan, first: dict[str, Array]) -> Scale:
    """T0 of each bench of its own, (members,)."""
    bare = Scale(measuring.SECONDS, measuring.STEP)
    if plan.request.saturate:
        bare = bare._replace(saturated=0.0)
    return bare._replace(time=objectives.time_of(plan.request.stage, first, bare)[0])


def judge(found: Searched) -> Tuning:
    """Before and after on the full bench, with margins."""
    plan, start = found.plan, found.plan.start
    stage = plan.request.stage
    tuned = start._replace(controller=laws.with_gains(start.controller, plan.law, found.gains))
    pair = (start, tuned)
    run: Callable[[Settings], Shown] = measuring.macro if stage == "macro" else measuring.micro
    shown = (run(start), run(tuned))
    arrays = [{k: np.array([[v]]) for k, v in s.metrics.items()} for s in shown]
    scale = _scale(plan, arrays[0])
    robust = margins = ripples = None
    if plan.ensemble is not None:
        gains = [laws.gains_of(s.controller, plan.law) for s in pair]
        before, after = engine_costs(plan, f"{stage}-bench")(np.stack(gains))
        robust = (float(before), float(after))
    if stage == "macro":
        margins = (loops.macro_margins(start.controller), loops.macro_margins(tuned.controller))
    else:
        ripples = (loops.ripple_margin(start, plan.law), loops.ripple_margin(tuned, plan.law))
    first, last = (float(objectives.costs(plan.objective, m, scale)[0, 0]) for m in arrays)
    return Tuning(
        plan,
        tuned,
        found.evaluations,
        found.engine_costs,
        shown,
        (first, last),
        robust,
        margins,
        ripples,
        found.history,
        found.trials,
        found.rejected,
    )


def macro(**options: Any) -> Tuning:
    """Tune a law of the macro-stage; options as in `Request`."""
    return tune(Request("macro", **options))


def micro(**options: Any) -> Tuning:
    """Tune a law of the micro-stage; options as in `Request`."""
    return tune(Request("micro", **options))
