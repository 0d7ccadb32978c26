"""What a tuning is asked for, and whether that can be done."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.control import outside
from macromicro.errors import InputError
from macromicro.schema.text import printable
from macromicro.settings import Settings
from macromicro.tuning import ensemble as ensembles
from macromicro.tuning import jobs, laws, objectives, thesis
from macromicro.tuning.ensemble import Ensemble
from macromicro.tuning.laws import Law
from macromicro.tuning.objectives import Objective

STAGES = ("macro", "micro")
ROUTES = ("optimise", "thesis")
ENGINES = ("model", "bench")
MOST = 10_000_000
MAX_SEED = 2**31
EVALUATIONS, SEED, AGGREGATE, BENCHES, HELD_OUT = 300, 0, "worst", 16, 200


class Request(NamedTuple):
    """What is wanted; None: not said, so the default, which is a constant of this module.

    Attributes
    ----------
    stage : {"macro", "micro"}
        To be tuned.
    objective : str
        As in `objectives`.
    law : str, optional
        By default the settings' own.
    evaluations, seed : int, optional
        The budget, and of the search.
    settings : Settings
        The bench and its controller.
    on : {"model", "bench"}, optional
        By default the model where it has the law.
    route : {"optimise", "thesis"}
        By search, or as Section 4.3.3 does.
    robust : bool
        On an ensemble of benches.
    aggregate : {"worst", "q95"}, optional
        How their costs become one.
    benches, held_out : int, optional
        To search on, and to judge by.
    penalties : tuple of (str, float)
        Weights by name, as in `objectives`.
    """

    stage: str
    objective: str = "settling"
    law: str | None = None
    evaluations: int | None = None
    seed: int | None = None
    settings: Settings = Settings()
    on: str | None = None
    route: str = "optimise"
    robust: bool = False
    aggregate: str | None = None
    benches: int | None = None
    held_out: int | None = None
    penalties: tuple[tuple[str, float], ...] = ()


class Plan(NamedTuple):
    """A request that was found good.

    Attributes
    ----------
    request : Request
        What is wanted.
    law : Law
        To be searched.
    objective : Objective
        To be minimised.
    engine : str
        A job's name.
    start : Settings
        With the law chosen.
    evaluations : int
        The budget, or the thesis' route's trials.
    seed : int
        Of the search.
    ensemble : Ensemble or None
        Of a robust search.
    held_out : Ensemble or None
        The fresh one that judges what it found.
    weights : dict of str to float
        Of all penalties by name.
    """

    request: Request
    law: Law
    objective: Objective
    engine: str
    start: Settings
    evaluations: int
    seed: int
    ensemble: Ensemble | None
    held_out: Ensemble | None
    weights: dict[str, float]


def check(request: Request) -> Plan:
    """Make a request's plan.

    Parameters
    ----------
    request : Request
        What is wanted.

    Returns
    -------
    Plan
        That can be followed.

    Raises
    ------
    InputError
        Anything wrong with it, an option that would have no effect among that.
    """
    stage = request.stage
    _one_of("stage", stage, STAGES)
    _one_of("--route", request.route, ROUTES)
    if request.on is not None:
        _one_of("--on", request.on, ENGINES)
    objective = objectives.find(stage, request.objective)
    weights = objectives.penalties(objective, dict(request.penalties))
    if stage == "macro" and request.law is not None and outside.is_name(request.law):
        joined = request.settings.controller.joined(request.law, "--law")
        request = request._replace(settings=request.settings._replace(controller=joined))
    law = laws.find(stage, request.law, request.settings.controller)
    evaluations = EVALUATIONS if request.evaluations is None else request.evaluations
    seed = SEED if request.seed is None else request.seed
    if not 1 <= evaluations <= MOST:
        raise InputError("--evaluations", evaluations, f"a whole number from 1 to {MOST}")
    if not 0 <= seed < MAX_SEED:
        raise InputError("--seed", seed, f"a whole number from 0 to {MAX_SEED - 1}")
    modelled = stage == "macro" and law.name in jobs.MODELLED
    if request.on == "model" and not modelled:
        raise InputError(
            "--on", "model", f"bench for {law.name}: the model's batch has {jobs.MODELLED_WORDS}"
        )
    if request.route == "thesis":
        _thesis(request, law, modelled)
        evaluations = thesis.TRIALS
    present = laws.gains_of(request.settings.controller, law)
    control = laws.with_gains(request.settings.controller, law, present)
    start = request.settings._replace(controller=control)
    ensemble, held_out = _ensembles(request, start, seed)
    engine = f"{stage}-{'model' if modelled and request.on != 'bench' else 'bench'}"
    return Plan(
        request, law, objective, engine, start, evaluations, seed, ensemble, held_out, weights
    )


def _thesis(request: Request, law: Law, modelled: bool) -> None:
    """InputError for what the thesis' route does not do."""
    if not modelled:
        raise InputError(
            "--route",
            "thesis",
            f"optimise for {request.stage} {law.name}: the thesis "
            "tunes the macro-stage's PD in this way",
        )
    given = (
        ("--robust", request.robust),
        ("--on bench", request.on == "bench"),
        ("--evaluations", request.evaluations is not None),
        ("--seed", request.seed is not None),
        ("--penalty", bool(request.penalties)),
    )
    for option, there in given:
        if there:
            raise InputError(option, "with --route thesis", f"{option} with --route optimise")


def _ensembles(
    request: Request, start: Settings, seed: int
) -> tuple[Ensemble, Ensemble] | tuple[None, None]:
    """Of a robust search: the benches to search on, and those to judge by."""
    if not request.robust:
        for option in ("aggregate", "benches", "held_out"):
            if getattr(request, option) is not None:
                flag = f"--{option.replace('_', '-')}"
                raise InputError(flag, "without --robust", f"{flag} with --robust")
        return None, None
    benches = BENCHES if request.benches is None else request.benches
    aggregate = AGGREGATE if request.aggregate is None else request.aggregate
    searched = ensembles.draw(request.stage, start, benches, aggregate, seed)
    count = HELD_OUT if request.held_out is None else request.held_out
    return searched, ensembles.fresh(searched, count)


def _one_of(where: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InputError(where, printable(value), f"one of {', '.join(known)}")
