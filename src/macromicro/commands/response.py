"""``macromicro response``: the measured frequency response of a machine's stages."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from macromicro.commands.group import whole
from macromicro.commands.options import PNG, Config, Figures, Json, Overwrite, Seed, folder_option
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.machines.machine import Machine
    from macromicro.report.bode import Shown

LOW, HIGH = 0.005, 0.3  # of the loop's frequency


class Asked(NamedTuple):
    """Frequencies (Hz; None: the usual ones), their number, and the seed."""

    low: float | None
    high: float | None
    number: int
    seed: int


def response(
    config: Config = None,
    low: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Lowest frequency.", show_default="0.005 / period"),
    ] = None,
    high: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Highest frequency.", show_default="0.3 / period"),
    ] = None,
    count: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Largest number of frequencies.")
    ] = 60,
    seed: Seed = 0,
    out: Annotated[Path | None, folder_option("results/response-<config>")] = None,
    overwrite: Overwrite = False,
    figures: Figures = PNG,
    as_json: Json = False,
) -> None:
    """Measure the Bode plot of a machine under its law.

    The linear model is drawn beside it. The stage travels while a sine is added to the effort, one
    frequency after another. The result shows plant, open loop and margins with friction, counts and
    limits (docs/machines.md). Two axes are measured one after the other. The two-stage machine's
    macro-stage gets the linear model (4.4) only.
    """
    from macromicro.drawing.files import formats
    from macromicro.machines.compositions import UNNAMED
    from macromicro.report import bode
    from macromicro.report.run import as_json as to_json
    from macromicro.runs import folder
    from macromicro.schema import keys

    kinds, asked = formats(figures), Asked(low, high, count, seed)
    keys.seed(seed, "--seed")
    keys.whole(count, 2, 10_000, "--count")
    usual = Path("results") / f"response-{config.stem if config else UNNAMED}"
    place = folder.chosen(out, usual, overwrite=overwrite)
    stages = _stages(config, asked)
    for name in stages:
        folder.check(place / name, 2_000_000, overwrite=overwrite, names=bode.FILES)
    contents = {}
    with Signals() as signals:
        for name, measure in stages.items():
            with folder.held(place / name, overwrite=overwrite, names=bode.FILES):
                found = measure()
                signals.later()
                bode.write(place / name, found, kinds)
            contents[name] = found.content()
            if not as_json:
                print(*([f"axis {name}:"] if name else []), *found.lines(), sep="\n")
            if signals.received:
                raise typer.Exit(signals.status)
    if as_json:
        print(to_json(contents.get("", contents)), end="")
        return
    print(f"results: {place}")


def _stages(config: Path | None, asked: Asked) -> dict[str, Callable[[], Shown]]:
    """What measures each stage of a machine, by its name; of the two-stage one its model."""
    from macromicro.commands import machine_run
    from macromicro.errors import ProblemError
    from macromicro.machines.compositions import each
    from macromicro.report import macro_bode
    from macromicro.settings import Settings, chosen

    if config is None or machine_run.is_two_stage(config):
        settings = chosen(Settings(), config, None)
        linear = macro_bode.found(settings, asked.low, asked.high, asked.number)
        return {"": lambda: linear}
    stages = each(config)
    for _, machine, _ in stages:
        if machine.model is None:
            raise ProblemError(
                "--config",
                f"the machine {machine.name} has no linear model",
                "Choose a machine that has one, such as axis.",
            )
    return {
        name: partial(_measured, name, machine, settings, asked)
        for name, machine, settings in stages
    }


def _measured(name: str, machine: Machine, settings: Any, asked: Asked) -> Shown:
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
