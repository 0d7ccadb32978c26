"""What a user asks to study: any machine with a programme, as the command and Python say it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro import programme as bench_programmes
from macromicro import simulate
from macromicro.batch import cores
from macromicro.batch.programme_job import ProgrammeJob
from macromicro.errors import ProblemError
from macromicro.machines import compositions, programmes, runs
from macromicro.robustness import job as jobs
from macromicro.robustness import stage
from macromicro.robustness.requirements import load
from macromicro.robustness.study import Request, Subject
from macromicro.runs.job import load as load_programme
from macromicro.schema import config, keys
from macromicro.settings import Settings, chosen
from macromicro.uncertainty.machines import counted
from macromicro.uncertainty.table import UNCERTAIN, VARIANTS

MAX_WORKERS = 256


class Ready(NamedTuple):
    settings: Any
    subject: Subject
    programme: str  # as it was named; "" for the machine's usual moves
    title: str  # of the programme
    place: str  # end of the folder's name
    compile: Callable[[], None]
    is_compiled: Callable[[], bool]
    fan: bool = False

    def request(self, samples: int, seed: int, limits: Path | None) -> Request:
        counted(samples)
        keys.seed(seed, "--seed")
        needed = self.subject.required
        if limits is not None:
            needed = load(limits, self.subject.metrics[:-1], needed)
        return Request(self.settings, needed, samples, seed)


def ready(
    path: Path | None,
    programme: str | None,
    law: str | None,
    workers: int | None,
    *,
    settings: Any = None,
    fan: bool = False,
    variants: bool = False,
) -> Ready:
    """A study of the machine of a settings file; `settings` replace the file's."""
    if settings is not None:
        config.check(settings, "settings")
    if compositions.is_two_stage(path):
        own = chosen(Settings(), path, law) if settings is None else chosen(settings, None, law)
        return _bench(own, programme or "thesis", workers, fan, variants)
    for option, given in (("--fan", fan), ("--variants", variants)):
        if given:
            raise ProblemError(option, "only for the two-stage machine")
    assert path is not None
    machine, own = compositions.with_settings(path, law, settings)
    moves = programmes.chosen(machine, own, programme)
    plan = programmes.plan(machine, own, moves)
    subject = stage.subject(machine, own, plan, _threads(workers))

    def compile_machine() -> None:
        runs.compile_machine(machine, own, plan)

    return Ready(
        own, subject, programme or "", moves.title, path.stem, compile_machine, runs.is_compiled
    )


def _bench(
    settings: Settings, programme: str, workers: int | None, fan: bool, variants: bool
) -> Ready:
    """The two-stage machine."""
    place = bench_programmes.find(programme)
    title = load_programme(place, settings).title
    job = ProgrammeJob(programme, fan=fan, settings=settings)
    varied = UNCERTAIN + VARIANTS if variants else UNCERTAIN
    subject = jobs.subject(job, _threads(workers), varied)
    return Ready(
        settings, subject, programme, title, place.stem, job.compile, simulate.is_compiled, fan
    )


def _threads(workers: int | None) -> int:
    """One for each core, where a user does not say."""
    return cores() if workers is None else keys.whole(workers, 1, MAX_WORKERS, "--workers")
