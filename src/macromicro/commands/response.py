"""``macromicro response``: the frequency response of a machine of one stage, measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from macromicro.commands.group import PNG, Figures, whole
from macromicro.commands.signals import Signals

LOW, HIGH = 0.005, 0.3  # of the loop's frequency


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
    loop and margins as they are with friction, counts and limits (docs/machines.md).
    """
    from macromicro.drawing.bar import progress
    from macromicro.drawing.files import formats
    from macromicro.errors import InputError
    from macromicro.machines import sweeping
    from macromicro.machines.machine import load
    from macromicro.report import bode
    from macromicro.report.summary import as_json as to_json
    from macromicro.runs import folder
    from macromicro.schema import keys

    kinds = formats(figures)
    machine, settings = load(config)
    model = machine.model
    if model is None:
        raise InputError("--config", machine.name, "a machine with a linear model, such as axis")
    keys.seed(seed, "--seed")
    keys.whole(count, 2, 10_000, "--count")
    dt = settings.timing.period
    frequency = sweeping.frequencies(
        LOW / dt if low is None else low, HIGH / dt if high is None else high, count, dt
    )
    place = out or Path("results") / f"response-{config.stem}"
    folder.check(place, 2_000_000, overwrite=overwrite, names=bode.FILES)
    with (
        Signals() as signals,
        folder.held(place, overwrite=overwrite, names=bode.FILES),
        progress(f"response of the {machine.kind.name}", "frequencies") as pace,
    ):
        found = sweeping.measured(
            machine,
            settings,
            frequency,
            lambda f: model(settings, f),
            seed=seed,
            progress=pace.reach,
        )
        signals.later()
        whole_found = bode.Found(machine, settings, found, model(settings, frequency), seed)
        bode.write(place, whole_found, kinds)
    if as_json:
        print(to_json(bode.content(whole_found)), end="")
        return
    print("\n".join(bode.lines(whole_found)))
    print(f"results: {place}")
