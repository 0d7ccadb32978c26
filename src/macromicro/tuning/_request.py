"""The request of a tuning, and its checks."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.control import outside
from macromicro.errors import InputError, ProblemError
from macromicro.schema.text import printable
from macromicro.settings import Settings
from macromicro.tuning import _ensemble as ensembles
from macromicro.tuning import _laws, _objectives, thesis
from macromicro.tuning._ensemble import Ensemble
from macromicro.tuning._laws import Law
from macromicro.tuning._objectives import Objective

STAGES = ("macro", "micro")
ROUTES = ("optimise", "thesis")
PD_LAWS = ("pd-initial", "pd-tuned")  # those that the thesis' route tunes
MOST = 10_000_000
MAX_SEED = 2**31
EVALUATIONS, SEED, AGGREGATE, BENCHES, HELD_OUT = 300, 0, "worst", 16, 200


class Request(NamedTuple):
    """Options of a tuning; None takes the default, a constant of this module.

    Examples
    --------
    >>> from macromicro.tuning import Request
    >>> Request("macro", evaluations=100, seed=1).objective
    'settling'
    """

    stage: str  #: to be tuned
    objective: str = "settling"
    law: str | None = None  #: by default the settings' own
    #: evaluations, seed: the budget, and of the search
    evaluations: int | None = None
    seed: int | None = None
    settings: Settings = Settings()  #: the bench and its controller
    route: str = "optimise"  #: by search, or as Section 4.3.3 does
    robust: bool = False  #: on an ensemble of benches
    aggregate: str | None = None  #: how their costs become one
    #: benches, held_out: to search on, and to judge by
    benches: int | None = None
    held_out: int | None = None
    penalties: tuple[tuple[str, float], ...] = ()  #: weights by name, as in `objectives`


class Plan(NamedTuple):
    request: Request  # what is wanted
    law: Law  # to be searched
    objective: Objective  # to be minimised
    engine: str  # A job's name
    start: Settings  # with the law chosen
    evaluations: int  # the budget, or the thesis' route's trials
    seed: int  # of the search
    ensemble: Ensemble | None  # of a robust search
    held_out: Ensemble | None  # the fresh one that judges what it found
    weights: dict[str, float]  # of all penalties by name


def check(request: Request) -> Plan:
    stage = request.stage
    _one_of("stage", stage, STAGES)
    _one_of("--route", request.route, ROUTES)
    objective = _objectives.find(stage, request.objective)
    weights = _objectives.penalties(objective, dict(request.penalties))
    if stage == "macro" and request.law is not None and outside.is_name(request.law):
        joined = request.settings.controller.joined(request.law, "--law")
        request = request._replace(settings=request.settings._replace(controller=joined))
    law = _laws.find(stage, request.law, request.settings.controller)
    evaluations = EVALUATIONS if request.evaluations is None else request.evaluations
    seed = SEED if request.seed is None else request.seed
    if not 1 <= evaluations <= MOST:
        raise InputError("--evaluations", evaluations, f"a whole number from 1 to {MOST}")
    if not 0 <= seed < MAX_SEED:
        raise InputError("--seed", seed, f"a whole number from 0 to {MAX_SEED - 1}")
    if request.route == "thesis":
        _thesis(request, law)
        evaluations = thesis.TRIALS
    present = _laws.gains_of(request.settings.controller, law)
    control = _laws.with_gains(request.settings.controller, law, present)
    start = request.settings._replace(controller=control)
    ensemble, held_out = _ensembles(request, start, seed)
    return Plan(
        request, law, objective, f"{stage}-bench", start, evaluations, seed, ensemble, held_out,
        weights,
    )  # fmt: skip


def _thesis(request: Request, law: Law) -> None:
    """Refuse options that the thesis' route does not have."""
    if request.stage != "macro" or law.name not in PD_LAWS:
        raise ProblemError(
            "--route thesis",
            f"only for the PD of the macro-stage, not for {request.stage} {law.name}",
            "Use --route optimise.",
        )
    given = (
        ("--robust", request.robust),
        ("--evaluations", request.evaluations is not None),
        ("--seed", request.seed is not None),
        ("--penalty", bool(request.penalties)),
    )
    for option, there in given:
        if there:
            raise ProblemError(option, "not allowed with --route thesis", "Use --route optimise.")


def _ensembles(
    request: Request, start: Settings, seed: int
) -> tuple[Ensemble, Ensemble] | tuple[None, None]:
    """The benches to search on and those to judge by, for a robust search."""
    if not request.robust:
        for option in ("aggregate", "benches", "held_out"):
            if getattr(request, option) is not None:
                flag = f"--{option.replace('_', '-')}"
                raise ProblemError(flag, "only with --robust")
        return None, None
    benches = BENCHES if request.benches is None else request.benches
    aggregate = AGGREGATE if request.aggregate is None else request.aggregate
    searched = ensembles.draw(request.stage, start, benches, aggregate, seed)
    count = HELD_OUT if request.held_out is None else request.held_out
    return searched, ensembles.fresh(searched, count)


def _one_of(where: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InputError(where, printable(value), f"one of {', '.join(known)}")
