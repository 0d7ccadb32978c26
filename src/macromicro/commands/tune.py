"""``macromicro tune``: gains by search or by the thesis' route, judged on the bench."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from macromicro.commands import _machine_studies, machine_run
from macromicro.commands.group import PNG, Figures, tell, whole
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.tuning.tune import Plan


def tune(  # noqa: PLR0913, PLR0917 - one for each option
    stage: Annotated[
        str,
        typer.Argument(help=("macro or micro; for other machines their name, such as axis or xy.")),
    ],
    objective: Annotated[
        str, typer.Option(metavar="NAME", help="Objective: settling, iae or effort.")
    ] = "settling",
    law: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Control law, or MODULE:LAW of your own (docs/laws.md).",
            show_default="that of the settings",
        ),
    ] = None,
    evaluations: Annotated[
        int | None,
        typer.Option(
            parser=whole, metavar="N", help="Largest number of designs to try.", show_default="300"
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(parser=whole, metavar="N", help="Seed of the search.", show_default="0"),
    ] = None,
    route: Annotated[
        str, typer.Option(metavar="NAME", help="optimise, or thesis for the macro-stage's PD.")
    ] = "optimise",
    robust: Annotated[
        bool,
        typer.Option("--robust", help="Search on an ensemble of benches and judge on fresh ones."),
    ] = False,
    aggregate: Annotated[
        str | None,
        typer.Option(
            metavar="HOW", help="Cost of an ensemble: worst or q95.", show_default="worst"
        ),
    ] = None,
    benches: Annotated[
        int | None,
        typer.Option(parser=whole, metavar="N", help="Benches to search on.", show_default="16"),
    ] = None,
    held_out: Annotated[
        int | None,
        typer.Option(
            parser=whole, metavar="N", help="Fresh benches to judge on.", show_default="200"
        ),
    ] = None,
    penalty: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=WEIGHT",
            help=(
                "Weight of a penalty: overshoot, saturated, error or slower; 0 "
                "for none; may be repeated."
            ),
            show_default="as the output lists them",
        ),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="TOML file with units that overrides settings.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results.", show_default="results/tune-STAGE")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace earlier results.")
    ] = False,
    figures: Figures = PNG,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print only the results, as JSON.")
    ] = False,
) -> None:
    """Find better gains for a control law and judge them.

    With a --config file of a machine of one stage (docs/machines.md) the gains are those of its
    law, and --objective is settling, error or rest. The machine xy (docs/xy.md) is tuned axis by
    axis, then both axes for the path.
    """
    from macromicro.runs.folder import chosen, held

    if config is not None and not machine_run.takes_turns(config):
        from macromicro import studies

        options: dict[str, object] = {
            "--aggregate": aggregate,
            "--penalty": penalty,
        }
        options |= {"--route": route if route != "optimise" else None}
        if _machine_studies.of_several(config):
            options |= {"--robust": robust}
        if not robust:
            for option, count in (("--benches", benches), ("--held-out", held_out)):
                options[option] = None if count is None else str(count)
        _machine_studies.only(options, _machine_studies.name_of(config))
        place = chosen(out, Path(f"results/tune-{stage}"), overwrite=overwrite)
        asked = _machine_studies.Asked(config, law, place, overwrite, figures, as_json, seed or 0)
        several = (
            studies.OTHERS if benches is None else benches,
            studies.FRESH if held_out is None else held_out,
        )
        budget = 300 if evaluations is None else evaluations
        _machine_studies.tune(asked, stage, objective, budget, several if robust else (None, None))
        return
    from macromicro.drawing.files import formats
    from macromicro.schema.config import load_overrides
    from macromicro.settings import Settings
    from macromicro.tuning import files
    from macromicro.tuning.tune import Request, check

    kinds = formats(figures)
    settings = Settings() if config is None else load_overrides(config, Settings())
    request = Request(
        stage, objective, law, evaluations, seed, settings, route, robust, aggregate, benches,
        held_out, _penalties(penalty or []),
    )  # fmt: skip
    plan = check(request)
    tell(plan.start.controller)
    place = chosen(out, Path(f"results/tune-{stage}"), overwrite=overwrite)
    files.check(place, overwrite=overwrite)
    with Signals() as signals, held(place, overwrite=overwrite, names=files.FILES):
        _tune(plan, place, kinds, as_json, signals)


def _penalties(texts: list[str]) -> tuple[tuple[str, float], ...]:
    from macromicro.errors import InputError
    from macromicro.schema.text import printable

    found: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            found[name] = float(number)
        except ValueError:
            accepted = "NAME=WEIGHT with a number, such as saturated=0.01"
            raise InputError("--penalty", printable(text), accepted) from None
    return tuple(found.items())


def _tune(plan: Plan, place: Path, kinds: tuple[str, ...], as_json: bool, signals: Signals) -> None:
    from macromicro.drawing.bar import progress
    from macromicro.tuning import files, tables
    from macromicro.tuning.evolution import Stop
    from macromicro.tuning.tune import judge, prepare, search

    what = f"{plan.request.stage}-stage, objective {plan.request.objective}"
    prepare(plan)
    signals.later(_machine_studies.ENDING)
    try:
        with progress(f"tuning the {what}", "evaluations at most") as pace:
            pace.begin(plan.evaluations)

            def tell(done: int, best: float) -> None:
                pace.reach(done, plan.evaluations, f"least cost {best:.4g}")
                if signals.received:
                    raise Stop

            searched = search(plan, tell)
        found = judge(searched)
    except (Stop, KeyboardInterrupt):  # before a search has found anything, or a second signal
        print("macromicro: interrupted, nothing was written", file=sys.stderr)
        raise typer.Exit(signals.status) from None
    files.write(place, found, kinds)
    if as_json:
        print(files.as_json(found), end="")
    else:
        for line in tables.text(found):
            print(line)
        print(_machine_studies.results(place, files.SETTINGS, better=found.better))
    _machine_studies.ended(signals, found.evaluations)
