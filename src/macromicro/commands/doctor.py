"""``macromicro doctor``: checks whether this computer has what the live machine needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from macromicro.commands.options import Config, Rig, Yes
from macromicro.serve.hosts import FOLDER, HOST, SCPI_PORT, WEB_PORT

if TYPE_CHECKING:
    from macromicro.serve.health import Finding


def doctor(  # noqa: PLR0913, PLR0917 - one for each option
    rig: Rig = "twin",
    look: Annotated[
        bool, typer.Option("--open", help="Only open and read the rig, with its outputs safe.")
    ] = False,
    move: Annotated[
        str | None,
        typer.Option(
            metavar="VOLTS",
            help=(
                "Open and move the rig: signs, stop, a process killed in "
                "motion. With --walk: largest motor voltage, by default 6 V."
            ),
            show_default=False,
        ),
    ] = None,
    walk: Annotated[
        bool,
        typer.Option(
            "--walk", help=("Guide through the first power-up; each step asks before it moves.")
        ),
    ] = False,
    heat: Annotated[
        str | None,
        typer.Option(
            metavar="VOLTS",
            help="With --walk: CTRL voltage for one second in the wire.",
            show_default="1.7 V",
        ),
    ] = None,
    yes: Yes = False,
    config: Config = None,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = HOST,
    scpi: Annotated[int, typer.Option(metavar="PORT", help="SCPI port; -1 for none.")] = SCPI_PORT,
    web: Annotated[
        int, typer.Option(metavar="PORT", help="Port of the page; -1 for none.")
    ] = WEB_PORT,
    record: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for recordings.", show_default=str(FOLDER)),
    ] = None,
    state: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Position file.", show_default="as of serve")
    ] = None,
    port: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PORT",
            help=("Serial port of --rig board; or numbers of the TCP ports to check."),
            show_default=False,
        ),
    ] = None,
    law: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Check only this law of your own, MODULE:LAW (docs/laws.md).",
            show_default=False,
        ),
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help=("Check only this machine of your own, MODULE:MACHINE (docs/own-machines.md)."),
            show_default=False,
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            min=0.5,
            max=86400.0,
            help=(
                "Only measure for S seconds how well this computer keeps the loop's period, with "
                "the simulated machine."
            ),
            show_default=False,
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="With --seconds: draw the histograms (.png, .pdf or .svg).",
            show_default=False,
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print only JSON.")] = False,
) -> None:
    """Check whether this computer has what `macromicro serve` needs.

    The options are those of `serve`. Each problem is printed with its remedy.
    --law checks a control law of your own, --machine a machine, --open, --move or --walk a rig, and
    --seconds the timing of the loop; nothing else is checked then.
    The exit status is 1 if a check fails. Warnings do not count.
    """
    from json import dumps

    from macromicro.commands import _checking, _timing, _walking
    from macromicro.rig.board.named import joined
    from macromicro.serve import health, persist
    from macromicro.serve.settings import load

    checks = {
        "--machine": machine is not None,
        "--law": law is not None,
        "--seconds": seconds is not None,
        "--walk": walk,
        "--open or --move": (look or move is not None) and not walk,
    }
    _one_of(checks, {"--heat": ("--walk", heat), "--figure": ("--seconds", figure)})
    if seconds is not None:
        _timing.measured(config, seconds, figure, as_json=json)
        return
    numbers = [each for each in port or () if each.isdigit()]
    devices = [each for each in port or () if not each.isdigit()]
    rig = joined(rig, devices[0] if devices else None, None, None)
    if machine is not None:
        findings = _checking.machine(machine)
    elif walk:
        findings = _each(rig, lambda one: _walking.rig(one, move, heat, yes=yes))
    elif look or move is not None:
        findings = _each(rig, lambda one: _checking.rig(one, move, yes=yes))
    elif law is None:
        ports = _ports(scpi, web, numbers)
        settings = load(config)
        position = state or persist.default_path(settings.place(rig))
        asked = health.Asked(
            settings.rigs(rig), position, host, ports, record or FOLDER, settings.period
        )
        findings = health.findings(asked, settings.serve)
    else:
        findings = _checking.law(law)
    found = []
    for each in findings:
        found.append(each)
        if not json:
            _say(each)
    if json:
        print(dumps([each._asdict() for each in found], indent=2))
    if health.worst(found) == health.FAIL:
        raise typer.Exit(1)


def _one_of(checks: Mapping[str, bool], belonging: Mapping[str, tuple[str, object]]) -> None:
    """Refuse checks that exclude each other, and options without the check they belong to."""
    from macromicro.errors import ProblemError

    several = [option for option, given in checks.items() if given]
    if len(several) > 1:
        raise ProblemError(several[0], f"not together with {several[1]}", "Check one at a time.")
    for option, (check, given) in belonging.items():
        if given is not None and not checks[check]:
            raise ProblemError(option, f"only with {check}")


def _each(rig: str, look: Callable[[str], Iterator[Finding]]) -> Iterator[Finding]:
    """The findings of a rig; of two axes one after the other, each under its name."""
    from macromicro.machines import on_rig

    if not on_rig.several(rig):
        yield from look(rig)
        return
    for name in on_rig.named(rig):
        for each in look(name):
            yield each._replace(what=f"{name}, {each.what}")


def _ports(scpi: int, web: int, others: Sequence[str]) -> dict[int, str]:
    """Ports to check, by number; a free one chosen by the system is always available."""
    from macromicro.errors import InputError

    for option, port in (("--scpi", scpi), ("--web", web)):
        if not -1 <= port <= 65535:
            raise InputError(
                option, port, "a port from 1 to 65535, 0 for any free one, -1 for none"
            )
    for other in others:
        if not 1 <= int(other) <= 65535:
            raise InputError("--port", other, "a serial port, or a TCP port from 1 to 65535")
    if others:
        return dict.fromkeys(map(int, others), "as asked")
    return {port: what for port, what in ((scpi, "SCPI"), (web, "web page")) if port > 0}


def _say(each: Finding) -> None:
    print(f"{each.state:5}{each.what}: {each.found}", flush=True)
    if each.remedy:
        print(f"{'':5}  -> {each.remedy}", flush=True)
