"""``macromicro doctor``: does this computer have what the live machine needs?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from macromicro.serve.health import Finding


def doctor(
    rig: Annotated[
        str, typer.Option(metavar="NAME", help="Whose position file: twin, or MODULE:FACTORY.")
    ] = "twin",
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Settings file (.toml).", show_default=False),
    ] = None,
    port: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N",
            min=1,
            max=65535,
            help="Ports to look at.",
            show_default="SCPI's and the web page's",
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else.")] = False,
) -> None:
    """Check Python, packages, cache, clock, permissions, disk and ports, and say what to do.

    Exit status 1 if anything fails; a warning is none.
    """
    from json import dumps

    from macromicro.serve import health
    from macromicro.serve.settings import load

    settings = load(config).serve
    ports = dict.fromkeys(port, "as asked") if port else health.PORTS
    found = []
    for each in health.findings(rig, settings, ports):
        found.append(each)
        if not json:
            _say(each)
    if json:
        print(dumps([each._asdict() for each in found], indent=2))
    if health.worst(found) == health.FAIL:
        raise typer.Exit(1)


def _say(each: Finding) -> None:
    print(f"{each.state:5}{each.what}: {each.found}", flush=True)
    if each.remedy:
        print(f"{'':5}  -> {each.remedy}", flush=True)
