"""``macromicro limits``: what a bench can do at best, by its own parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

WAYS = ("200 mm", "100 mm", "40 mm", "10 mm", "1 mm")


def limits(
    ways: Annotated[
        list[str] | None,
        typer.Argument(metavar="WAY ...", help="Ways of the carriage.", show_default="200 mm ..."),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="FILE", help="TOML file of the bench's settings.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the limits as JSON, and nothing else.")
    ] = False,
) -> None:
    """Print the quickest moves of the carriage that a bench allows.

    Full effort, and full effort the other way, with the bench's own parameters: for judging laws,
    which may not read them (docs/beyond.md).
    """
    from macromicro.design.limits import quickest
    from macromicro.report.summary import as_json as to_json
    from macromicro.settings import Settings, chosen
    from macromicro.units import quantity

    places = [(text, quantity(text, "m", "WAY")) for text in ways or WAYS]
    settings = chosen(Settings(), config, None)
    found = [quickest(settings.bench, settings.sensors, way) for _, way in places]
    if as_json:
        print(to_json({"quickest": [each._asdict() for each in found]}), end="")
        return
    print(f"{'way':>10}  {'to one count':>12}  {'full effort':>11}")
    for (text, _), each in zip(places, found, strict=True):
        print(f"{text:>10}  {each.time:>10.3f} s  {each.full / 1e3:>9.3f} s")
