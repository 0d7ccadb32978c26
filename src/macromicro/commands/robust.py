"""``macromicro robust``: performance with parameters other than the nominal ones."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from macromicro.commands import machine_run
from macromicro.commands.group import tell, whole
from macromicro.commands.options import PNG, Config, Figures, Json, Law, Overwrite, Seed
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.robustness.study import Request, Subject

SAMPLES = 200


def robust(  # noqa: PLR0913, PLR0917 - a parameter for each option
    samples: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Number of machines.")
    ] = SAMPLES,
    seed: Seed = 0,
    config: Config = None,
    programme: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="A programme file, or the name of an example.",
            show_default="thesis",
        ),
    ] = None,
    requirements: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="TOML file of limits, such as macro_settling = '0.8 s'.",
            show_default=False,
        ),
    ] = None,
    law: Law = None,
    fan: Annotated[bool, typer.Option("--fan", help="Cool the actuator with a fan.")] = False,
    variants: Annotated[
        bool,
        typer.Option(
            "--variants",
            help=(
                "Also vary effects that no model has (docs/variants.md), such as creep and draught."
            ),
        ),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            parser=whole, metavar="N", help="Number of threads.", show_default="one for each core"
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the results.", show_default="results/robust-<programme>"),
    ] = None,
    overwrite: Overwrite = False,
    figures: Figures = PNG,
    as_json: Json = False,
) -> None:
    """Try machines with other friction, load, noise and more.

    The two-stage machine also varies belt, room temperature and the age of its actuator. With a
    --config file of another machine (docs/machines.md) what its data sheets leave open varies.
    """
    from macromicro.drawing.files import formats
    from macromicro.errors import ProblemError
    from macromicro.robustness import files
    from macromicro.runs import folder
    from macromicro.runs.folder import held

    kinds = formats(figures)
    if config is None or machine_run.takes_turns(config):
        asked = _bench(config, law, programme or "thesis", workers, fan=fan, variants=variants)
    else:
        for option, given in (("--fan", fan), ("--variants", variants)):
            if given:
                raise ProblemError(option, "only for the two-stage machine")
        asked = _machine(config, law, programme, workers)
    request = asked.request(samples, seed, requirements)
    place = folder.chosen(out, Path("results") / f"robust-{asked.place}", overwrite=overwrite)
    folder.check(place, files.BYTES, overwrite=overwrite, names=files.FILES)
    with Signals() as signals, held(place, overwrite=overwrite, names=files.FILES):
        _robust(request, asked, (kinds, as_json), place, signals)


class _Asked(NamedTuple):
    settings: Any
    subject: Subject
    programme: str  # as on the command line
    title: str  # of the programme
    place: str  # end of the folder's name
    compile: Callable[[], None] = lambda: None
    fan: bool = False

    def request(self, samples: int, seed: int, limits: Path | None) -> Request:
        from macromicro.robustness.requirements import load
        from macromicro.robustness.study import Request
        from macromicro.schema import keys
        from macromicro.uncertainty.machines import counted

        counted(samples)
        keys.seed(seed, "--seed")
        needed = self.subject.required
        if limits is not None:
            needed = load(limits, self.subject.metrics[:-1], needed)
        return Request(self.settings, needed, samples, seed)


def _bench(
    config: Path | None,
    law: str | None,
    programme: str,
    workers: int | None,
    *,
    fan: bool,
    variants: bool,
) -> _Asked:
    """The two-stage machine."""
    from macromicro import programme as programmes
    from macromicro import studies
    from macromicro.batch.programme_job import ProgrammeJob
    from macromicro.robustness import job as jobs
    from macromicro.runs.job import load
    from macromicro.settings import Settings
    from macromicro.settings import chosen as settings_of
    from macromicro.uncertainty.table import UNCERTAIN, VARIANTS

    settings = settings_of(Settings(), config, law)
    place = programmes.find(programme)
    plan = load(place, settings)
    tell(settings.controller)
    job = ProgrammeJob(programme, fan=fan, settings=settings)
    varied = UNCERTAIN + VARIANTS if variants else UNCERTAIN
    subject = jobs.subject(job, studies.threads(workers, "--workers"), varied)

    def compile_bench() -> None:
        from macromicro.simulate import is_compiled

        if not is_compiled():
            print("compiling the bench, once, about 10 s", file=sys.stderr)
        job.compile()

    return _Asked(settings, subject, programme, plan.title, place.stem, compile_bench, fan)


def _machine(config: Path, law: str | None, programme: str | None, workers: int | None) -> _Asked:
    """A machine of one stage, or of several on one clock."""
    from macromicro import studies
    from macromicro.machines import compositions, doubts, programmes
    from macromicro.robustness import stage

    machine, settings = compositions.load(config, law)
    for each in doubts.found(settings):
        print(f"macromicro: warning: {each.text}", file=sys.stderr)
    moves = programmes.chosen(machine, settings, programme)
    plan = programmes.plan(machine, settings, moves)
    threads = studies.threads(workers, "--workers")
    subject = stage.subject(machine, settings, plan, threads)
    return _Asked(settings, subject, programme or "", moves.title, config.stem)


def _robust(
    request: Request,
    asked: _Asked,
    how: tuple[tuple[str, ...], bool],
    out: Path,
    signals: Signals,
) -> None:
    from macromicro.drawing.bar import progress
    from macromicro.report.provenance import software
    from macromicro.robustness import files, study, terminal
    from macromicro.robustness.words import About
    from macromicro.schema.config import difference

    kinds, as_json = how
    asked.compile()
    started, began = datetime.now().astimezone(), time.perf_counter()
    signals.later()
    with progress(asked.title, "runs") as pace:

        def report(done: int, total: int) -> bool:
            pace.reach(done, total)
            return bool(signals.received)

        found = study.run(request, asked.subject, report)
    if not len(found.rows):
        print("macromicro: interrupted before the first machine; nothing written", file=sys.stderr)
        raise typer.Exit(signals.status)
    overrides = difference(request.settings, asked.subject.default)
    about = About(
        asked.programme,
        asked.title,
        asked.fan,
        started.isoformat(sep=" ", timespec="seconds"),
        time.perf_counter() - began,
        {key: text.strip('"') for key, text in overrides.items()},
        tuple(software()),
    )
    files.write(out, found, about, kinds)
    if as_json:
        print(files.as_json(found, about), end="")
    else:
        terminal.show(found, about, str(out))
        print(f"page: {out / files.PAGE}")
    if found.interrupted:
        _interrupted(len(found.rows), request.samples, out)
        raise typer.Exit(signals.status)


def _interrupted(done: int, asked: int, out: Path) -> None:
    print(
        f"macromicro: interrupted after {done} of {asked} machines; "
        f"the results so far are in {out}, marked incomplete",
        file=sys.stderr,
    )
