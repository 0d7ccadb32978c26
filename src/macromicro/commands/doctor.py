"""``macromicro doctor``: does this computer have what the live machine needs?"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from macromicro.serve.hosts import FOLDER, HOST, SCPI_PORT, WEB_PORT

if TYPE_CHECKING:
    from macromicro.serve.health import Finding


def doctor(  # noqa: PLR0913, PLR0917 - one for each option
    rig: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="The twin, MODULE:FACTORY or FILE.toml; two axes: one for each, + between; not "
            "opened, but for --open, --move, --walk.",
        ),
    ] = "twin",
    look: Annotated[
        bool,
        typer.Option("--open", help="Open the rig and read it instead, its outputs safe."),
    ] = False,
    move: Annotated[
        str | None,
        typer.Option(
            metavar="VOLTS",
            help="Open it and move it, too: signs, stop, a process killed in motion. With --walk: "
            "the motor's greatest voltage, 6 V without.",
            show_default=False,
        ),
    ] = None,
    walk: Annotated[
        bool,
        typer.Option(
            "--walk", help="Walk through its first power-up, each step asking before it moves."
        ),
    ] = False,
    heat: Annotated[
        str | None,
        typer.Option(
            metavar="VOLTS",
            help="With --walk: CTRL for one second in the wire.",
            show_default="1.7 V",
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Move it without asking; steps by hand are skipped.")
    ] = False,
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Settings file (.toml).", show_default=False),
    ] = None,
    host: Annotated[str, typer.Option(help="Address to listen at.")] = HOST,
    scpi: Annotated[int, typer.Option(metavar="PORT", help="SCPI; -1 for none.")] = SCPI_PORT,
    web: Annotated[int, typer.Option(metavar="PORT", help="The page; -1 for none.")] = WEB_PORT,
    record: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for recordings.", show_default=str(FOLDER)),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Position file.", show_default="as of serve"),
    ] = None,
    port: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N", min=1, max=65535, help="Look at these ports instead.", show_default=False
        ),
    ] = None,
    law: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Check this law of your own instead, MODULE:LAW (docs/laws.md).",
            show_default=False,
        ),
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Check this machine of your own instead, MODULE:MACHINE (docs/own-machines.md).",
            show_default=False,
        ),
    ] = None,
    part: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Check this part of your own instead, MODULE:PART (docs/own-parts.md).",
            show_default=False,
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else.")] = False,
) -> None:
    """Check whether `macromicro serve` with these options has what it needs, and what to do.

    With --law a control law of your own is checked, with --machine a machine, with --part a part,
    with --open, --move or --walk what the rig does, and nothing else.
    Exit status 1 if anything fails; a warning is none.
    """
    from json import dumps

    from macromicro.commands import checking, walking
    from macromicro.errors import InputError
    from macromicro.serve import health, persist, preflight
    from macromicro.serve.choosing import load

    if machine is not None:
        findings = checking.machine(machine)
    elif heat is not None and not walk:
        raise InputError("--heat", heat, "with --walk")
    elif walk:
        findings = _each(rig, lambda one: walking.rig(one, move, heat, yes=yes))
    elif look or move is not None:
        findings = _each(rig, lambda one: checking.rig(one, move, yes=yes))
    elif part is not None:
        findings = checking.part(part)
    elif law is None:
        ports = _ports(scpi, web, port or ())
        settings = load(config)
        position = state or persist.default_path(settings.place(rig))
        asked = preflight.Asked(
            settings.rigs(rig), position, host, ports, record or FOLDER, settings.period
        )
        findings = preflight.findings(asked, settings.serve)
    else:
        findings = checking.law(law)
    found = []
    for each in findings:
        found.append(each)
        if not json:
            _say(each)
    if json:
        print(dumps([each._asdict() for each in found], indent=2))
    if health.worst(found) == health.FAIL:
        raise typer.Exit(1)


def _each(rig: str, look: Callable[[str], Iterator[Finding]]) -> Iterator[Finding]:
    """What is found of a rig; of those of two axes one after the other, each by its name."""
    from macromicro.machines.joint import two_rigs

    if not two_rigs.several(rig):
        yield from look(rig)
        return
    for name in two_rigs.named(rig):
        for each in look(name):
            yield each._replace(what=f"{name}, {each.what}")


def _ports(scpi: int, web: int, others: Sequence[int]) -> dict[int, str]:
    """What is to be looked at, by number; any free port is always there."""
    from macromicro.errors import InputError

    for option, port in (("--scpi", scpi), ("--web", web)):
        if not -1 <= port <= 65535:
            raise InputError(
                option, port, "a port from 1 to 65535, 0 for any free one, -1 for none"
            )
    if others:
        return dict.fromkeys(others, "as asked")
    return {port: what for port, what in ((scpi, "SCPI"), (web, "web page")) if port > 0}


def _say(each: Finding) -> None:
    print(f"{each.state:5}{each.what}: {each.found}", flush=True)
    if each.remedy:
        print(f"{'':5}  -> {each.remedy}", flush=True)
