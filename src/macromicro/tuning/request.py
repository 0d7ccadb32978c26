"""What a user asks for, checked before anything is searched."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.batch import cores
from macromicro.control import outside
from macromicro.errors import ProblemError
from macromicro.machines import compositions, doubts, programmes
from macromicro.machines.composite import Composite
from macromicro.schema import config, keys
from macromicro.schema.text import printable
from macromicro.settings import Settings
from macromicro.settings import choose as bench_settings
from macromicro.tuning import gains, search
from macromicro.tuning.bench import Macro, Micro
from macromicro.tuning.joint import Joint
from macromicro.tuning.search import Budget, Progress, Tuning
from macromicro.tuning.stage import Stage
from macromicro.tuning.subject import Subject

STAGES = {"macro": Macro, "micro": Micro}  # of the two-stage machine
EVALUATIONS, MACHINES, FRESH = 300, 16, 200
MOST_EVALUATIONS, MOST_MACHINES = 10_000_000, 1000


class Request(NamedTuple):
    config: Path | None = None  # settings file of the machine; None: the two-stage machine
    stage: str | None = None  # of the two-stage machine
    objective: str = "settling"
    law: str | None = None  # by default the settings' own
    evaluations: int = EVALUATIONS
    seed: int = 0
    robust: bool = False  # on several machines
    machines: int | None = None  # to search on, for a robust search
    fresh: int | None = None  # to judge by
    penalties: Mapping[str, float] = {}
    settings: Any = None  # by default those of the file


class Ready(NamedTuple):
    subject: Subject
    objective: str
    weights: Mapping[str, float]
    budget: Budget

    def search(self, progress: Progress = lambda done, best: None) -> Tuning:
        return search.search(self.subject, self.objective, self.weights, self.budget, progress)


def ready(request: Request) -> Ready:
    """What is searched; the request is refused where it cannot be met."""
    subject = _subject(request)
    subject.objective(request.objective)
    weights = subject.weights(request.penalties)
    fewest = search.LEAST * (len(subject.parts) + 1) if subject.parts else 1
    keys.whole(request.evaluations, fewest, MOST_EVALUATIONS, "--evaluations")
    keys.seed(request.seed, "--seed")
    machines, fresh = 1, 0
    given = {"--benches": request.machines, "--held-out": request.fresh}
    for option, count in given.items():
        if count is not None:
            if not request.robust:
                raise ProblemError(option, "only with --robust")
            keys.whole(count, 2, MOST_MACHINES, option)
    if request.robust:
        machines, fresh = request.machines or MACHINES, request.fresh or FRESH
        _ = subject.uncertain  # refused at once where there is no table
    budget = Budget(request.evaluations, request.seed, machines, fresh, cores())
    return Ready(subject, request.objective, weights, budget)


def _subject(request: Request) -> Subject:
    if compositions.is_two_stage(request.config):
        return _bench(request)
    path = request.config
    assert path is not None
    machine, own = compositions.with_settings(path, request.law, request.settings)
    where = printable(path, 300)
    doubts.refuse(own, where, "tune")
    plan = programmes.plan(machine, own, programmes.choose(machine, own))
    known = {machine.name}
    if not isinstance(machine, Composite):
        known |= {machine.kind.name}
    if request.stage is not None and request.stage not in known:
        raise ProblemError(
            f"stage {printable(request.stage)}",
            f"the machine of {where} is {machine.name}",
            "Leave the stage out.",
        )
    if isinstance(machine, Composite):
        return Joint(machine, own, plan)
    return Stage(machine, own, plan)


def _bench(request: Request) -> Subject:
    stage, law = request.stage, request.law
    if stage not in STAGES:
        problem = "missing" if stage is None else f"{printable(stage)} is none of this machine"
        raise ProblemError("stage", problem, f"Give {' or '.join(STAGES)}.")
    if request.settings is not None:
        config.check(request.settings, "settings")
    settings: Settings = request.settings or bench_settings(Settings(), request.config, None)
    if stage == "macro" and law is not None and outside.is_name(law):
        joined = settings.controller.joined(law, "--law")
        settings = settings._replace(controller=joined)
    return STAGES[stage](settings, gains.find(stage, law, settings.controller))
