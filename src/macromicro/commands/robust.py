"""``macromicro robust``: performance with parameters other than the nominal ones."""

from __future__ import annotations

import sys
import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from macromicro.commands import _machine_studies, machine_run
from macromicro.commands.group import PNG, Figures, Law, tell, whole
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.programme import Programme
    from macromicro.robustness.study import Request

SAMPLES = 200


def robust(  # noqa: PLR0913, PLR0917 - a parameter for each option
    samples: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Number of machines.")
    ] = SAMPLES,
    seed: Annotated[
        int,
        typer.Option(parser=whole, metavar="N", help="Seed of the sample and the sensors' noise."),
    ] = 0,
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="TOML file of the nominal settings.", show_default=False),
    ] = None,
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
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace earlier results.")
    ] = False,
    figures: Figures = PNG,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print only the results, as JSON.")
    ] = False,
) -> None:
    """Try machines with other friction, load, noise and more.

    The two-stage machine also varies belt, room temperature and the age of its actuator.
    With a --config file of a machine of one stage (docs/machines.md) friction, mass, motor and
    supply vary.
    """
    from macromicro.runs import folder
    from macromicro.runs.folder import held

    if config is not None and not machine_run.takes_turns(config):
        options: dict[str, object] = {"--fan": fan, "--variants": variants}
        _machine_studies.only(options, _machine_studies.name_of(config))
        place = folder.chosen(out, Path("results") / f"robust-{config.stem}", overwrite=overwrite)
        asked = _machine_studies.Asked(config, law, place, overwrite, figures, as_json, seed)
        _machine_studies.robust(asked, programme, samples, (workers, requirements))
        return
    programme = programme or "thesis"
    from macromicro import programme as programmes
    from macromicro.drawing.files import formats
    from macromicro.robustness import files

    kinds = formats(figures)
    request, plan = _request(samples, seed, (config, law), programme, requirements, workers)
    if variants:
        from macromicro.uncertainty.table import UNCERTAIN, VARIANTS

        request = request._replace(uncertain=UNCERTAIN + VARIANTS)
    place = folder.chosen(
        out, Path("results") / f"robust-{programmes.find(programme).stem}", overwrite=overwrite
    )
    folder.check(place, files.BYTES, overwrite=overwrite, names=files.FILES)
    with Signals() as signals, held(place, overwrite=overwrite, names=files.FILES):
        _robust(request, plan, (programme, fan, kinds, as_json), place, signals)


def _request(
    samples: int,
    seed: int,
    chosen: tuple[Path | None, str | None],
    programme: str,
    requirements: Path | None,
    workers: int | None,
) -> tuple[Request, Programme]:
    from macromicro import programme as programmes
    from macromicro import studies
    from macromicro.batch import cores
    from macromicro.robustness import requirements as limits
    from macromicro.robustness.study import Request
    from macromicro.runs.job import load
    from macromicro.schema import keys
    from macromicro.settings import Settings
    from macromicro.settings import chosen as settings_of
    from macromicro.uncertainty.machines import counted

    counted(samples)
    keys.seed(seed, "--seed")
    if workers is not None:
        keys.whole(workers, 1, studies.MAX_WORKERS, "--workers")
    settings = settings_of(Settings(), *chosen)
    needed = limits.DEFAULTS if requirements is None else limits.load(requirements)
    plan = load(programmes.find(programme), settings)
    return Request(settings, needed, samples, seed, workers or cores()), plan


def _robust(
    request: Request,
    plan: Programme,
    asked: tuple[str, bool, tuple[str, ...], bool],
    out: Path,
    signals: Signals,
) -> None:
    from macromicro.drawing.bar import progress
    from macromicro.report.provenance import software
    from macromicro.robustness import files, study, terminal
    from macromicro.robustness.job import RobustJob
    from macromicro.robustness.words import About
    from macromicro.schema.config import difference
    from macromicro.settings import Settings
    from macromicro.simulate import is_compiled

    programme, fan, kinds, as_json = asked
    if not is_compiled():
        print("compiling the bench, once, about 10 s", file=sys.stderr)
    tell(request.settings.controller)
    job = RobustJob(programme, fan, request.settings)
    job.compile()
    started, began = datetime.now().astimezone(), time.perf_counter()
    signals.later()
    with progress(plan.title, "runs") as pace:
        found = study.run(request, job, pace.reach, lambda: bool(signals.received))
    if not len(found.rows):
        print("macromicro: interrupted before the first machine; nothing written", file=sys.stderr)
        raise typer.Exit(signals.status)
    overrides = difference(request.settings, Settings())
    about = About(
        programme,
        plan.title,
        fan,
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
