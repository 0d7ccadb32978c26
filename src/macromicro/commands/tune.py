"""``macromicro tune``: gains by search, judged before and after."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from macromicro.commands.group import tell, whole
from macromicro.commands.options import (
    PNG,
    Config,
    Figures,
    Json,
    Law,
    Overwrite,
    Seed,
    folder_option,
)
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.tuning.request import Ready

ENDING = "stopping after this generation with the best so far (again: stop at once without results)"


def tune(  # noqa: PLR0913, PLR0917 - one for each option
    stage: Annotated[
        str | None,
        typer.Argument(
            help="macro or micro, of the two-stage machine; others need none.", show_default=False
        ),
    ] = None,
    objective: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="settling, iae or effort; for other machines settling, error or rest.",
        ),
    ] = "settling",
    law: Law = None,
    evaluations: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Largest number of designs to try.")
    ] = 300,
    seed: Seed = 0,
    robust: Annotated[
        bool, typer.Option("--robust", help="Search on varied machines and judge on fresh ones.")
    ] = False,
    benches: Annotated[
        int | None,
        typer.Option(parser=whole, metavar="N", help="Machines to search on.", show_default="16"),
    ] = None,
    held_out: Annotated[
        int | None,
        typer.Option(
            parser=whole, metavar="N", help="Fresh machines to judge on.", show_default="200"
        ),
    ] = None,
    penalty: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=WEIGHT",
            help="Weight of a penalty; 0 for none; may be repeated.",
            show_default="as the output lists them",
        ),
    ] = None,
    config: Config = None,
    out: Annotated[Path | None, folder_option("results/tune-<stage or config>")] = None,
    overwrite: Overwrite = False,
    figures: Figures = PNG,
    as_json: Json = False,
) -> None:
    """Find better gains for a control law and judge them.

    A machine of several stages is tuned stage by stage, then as a whole, for its path
    (docs/tuning.md).
    """
    from macromicro.drawing.files import formats
    from macromicro.runs import folder
    from macromicro.tuning import files
    from macromicro.tuning.request import Request, ready

    kinds = formats(figures)
    asked = Request(
        config, stage, objective, law, evaluations, seed, robust, benches, held_out,
        _penalties(penalty or []),
    )  # fmt: skip
    found = ready(asked)
    tell(found.subject.start)
    name = stage or (config.stem if config else "")
    place = folder.chosen(out, Path("results") / f"tune-{name}", overwrite=overwrite)
    folder.check(place, files.BYTES, overwrite=overwrite, names=files.FILES)
    with Signals() as signals, folder.held(place, overwrite=overwrite, names=files.FILES):
        _tune(found, place, kinds, as_json, signals)


def _penalties(texts: list[str]) -> dict[str, float]:
    from macromicro.errors import InputError
    from macromicro.schema.text import printable

    found: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            found[name] = float(number)
        except ValueError:
            accepted = "NAME=WEIGHT with a number, such as overshoot=0.01"
            raise InputError("--penalty", printable(text), accepted) from None
    return found


def _tune(
    asked: Ready, place: Path, kinds: tuple[str, ...], as_json: bool, signals: Signals
) -> None:
    from macromicro.drawing.bar import progress
    from macromicro.tuning import files
    from macromicro.tuning.evolution import Stop

    designs = asked.budget.evaluations
    asked.subject.prepare()
    signals.later(ENDING)
    try:
        with progress(f"tuning {asked.subject.name}, {asked.objective}", "designs") as pace:
            pace.begin(designs)

            def tell(done: int, best: float) -> None:
                pace.reach(done, designs, f"least cost {best:.4g}")
                if signals.received:
                    raise Stop

            found = asked.search(tell)
        report = files.summarise(found)
        files.write(place, report, kinds)
    except KeyboardInterrupt:  # a second signal
        print("macromicro: interrupted, nothing was written", file=sys.stderr)
        raise typer.Exit(signals.status) from None
    if as_json:
        print(files.as_json(report), end="")
    else:
        print(report.text)
        print(f"page: {place / files.PAGE}")
        if found.better:
            print(f"try: macromicro run --config {place / files.SETTINGS}")
    if signals.received:
        print(
            f"macromicro: interrupted after {found.evaluations} designs; the best is kept",
            file=sys.stderr,
        )
        raise typer.Exit(signals.status)
