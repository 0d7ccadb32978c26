"""``macromicro response``: the frequency response of a machine's stages, measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from macromicro.commands.group import PNG, Figures, whole
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.machines.machine import Machine
    from macromicro.report.bode import Found

LOW, HIGH = 0.005, 0.3  # of the loop's frequency


class Asked(NamedTuple):
    """What the user asked for: frequencies (Hz; None: the usual ones), how many, and the seed."""

    low: float | None
    high: float | None
    number: int
    seed: int


def response(
    config: Annotated[
        Path,
        typer.Option(metavar="FILE", help="Settings that name the machine.", show_default=False),
    ],
    low: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Lowest frequency.", show_default="0.005 / period"),
    ] = None,
    high: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Highest frequency.", show_default="0.3 / period"),
    ] = None,
    count: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Frequencies, at most.")
    ] = 60,
    seed: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Seed of the sensor's noise.")
    ] = 0,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the results.", show_default="results/response-<config>"),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace earlier results.")
    ] = False,
    figures: Figures = PNG,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON, and nothing else.")
    ] = False,
) -> None:
    """Measure the Bode plot of a machine under its law, beside the linear model's.

    The stage travels, and a sine is added to the effort, one frequency after another: plant, open
    loop and margins as they are with friction, counts and limits (docs/machines.md). Of two axes
    one after the other.
    """
    from macromicro.drawing.files import formats
    from macromicro.errors import InputError
    from macromicro.machines.compositions import each
    from macromicro.report import bode
    from macromicro.report.summary import as_json as to_json
    from macromicro.runs import folder
    from macromicro.schema import keys

    kinds, stages = formats(figures), each(config)
    for _, machine, _ in stages:
        if machine.model is None:
            accepted = "a machine with a linear model, such as axis"
            raise InputError("--config", machine.name, accepted)
    keys.seed(seed, "--seed")
    keys.whole(count, 2, 10_000, "--count")
    asked = Asked(low, high, count, seed)
    place = out or Path("results") / f"response-{config.stem}"
    folders = [place / name for name, _, _ in stages]
    for one in folders:
        folder.check(one, 2_000_000, overwrite=overwrite, names=bode.FILES)
    told = {}
    with Signals() as signals:
        for one, (name, machine, settings) in zip(folders, stages, strict=True):
            with folder.held(one, overwrite=overwrite, names=bode.FILES):
                found = _measured(name, machine, settings, asked)
                signals.later()
                bode.write(one, found, kinds)
            told[name] = bode.content(found)
            if not as_json:
                print(*([f"axis {name}:"] if name else []), *bode.lines(found), sep="\n")
            if signals.received:
                raise typer.Exit(signals.status)
    if as_json:
        print(to_json(told.get("", told)), end="")
        return
    print(f"results: {place}")


def _measured(name: str, machine: Machine, settings: Any, asked: Asked) -> Found:
    """The response of one stage, beside its model's."""
    from macromicro.drawing.bar import progress
    from macromicro.machines import sweeping
    from macromicro.report import bode

    model, dt = machine.model, settings.timing.period
    assert model is not None  # as the command has looked
    low = LOW / dt if asked.low is None else asked.low
    high = HIGH / dt if asked.high is None else asked.high
    frequency = sweeping.frequencies(low, high, asked.number, dt)
    of = f"axis {name}" if name else f"the {machine.kind.name}"
    with progress(f"response of {of}", "frequencies") as pace:
        found = sweeping.measured(
            machine,
            settings,
            frequency,
            lambda f: model(settings, f),
            seed=asked.seed,
            progress=pace.reach,
        )
    return bode.Found(machine, settings, found, model(settings, frequency), asked.seed)
