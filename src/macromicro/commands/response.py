"""``macromicro response``: the measured frequency response of a machine's stages."""

from __future__ import annotations

from pathlib import Path

import typer

from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals


def response(
    config: Path | None = None,
    low: float | None = None,
    high: float | None = None,
    count: int = 60,
    seed: int = 0,
    out: Path | None = None,
    overwrite: bool = False,
    figures: str = PNG,
    as_json: bool = False,
) -> None:
    """Measure the Bode plot of a machine under its law.

    The linear model is drawn beside it. The stage travels while a sine is added to the effort, one
    frequency after another. The result shows plant, open loop and margins with friction, counts and
    limits (docs/machines.md). Two axes are measured one after the other. The two-stage machine's
    macro-stage gets the linear model (4.4) only.
    """
    from macromicro.drawing.files import formats
    from macromicro.machines.compositions import TWO_STAGE
    from macromicro.report import bode, responses
    from macromicro.report.run import as_json as to_json
    from macromicro.runs import folder
    from macromicro.schema import keys

    kinds, asked = formats(figures), responses.Asked(low, high, count, seed)
    keys.seed(seed, "--seed")
    keys.whole(count, 2, 10_000, "--count")
    usual = Path("results") / f"response-{config.stem if config else TWO_STAGE.name}"
    place = folder.choose_folder(out, usual, overwrite=overwrite)
    stages = responses.stages(config, asked)
    for name in stages:
        folder.check(place / name, 2_000_000, overwrite=overwrite, names=bode.FILES)
    contents = {}
    with Signals() as signals:
        for name, measure in stages.items():
            with folder.locked(place / name, overwrite=overwrite, names=bode.FILES):
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
