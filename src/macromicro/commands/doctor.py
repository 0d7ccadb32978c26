"""``macromicro doctor``: checks whether this computer has what the live machine needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from macromicro.commands.group import check_ports
from macromicro.serve.hosts import FOLDER, HOST, SCPI_PORT, WEB_PORT

if TYPE_CHECKING:
    from macromicro.serve.health import Finding


def doctor(  # noqa: PLR0913, PLR0917 - one for each option
    rig: str = "twin",
    look: bool = False,
    move: str | None = None,
    walk: bool = False,
    heat: str | None = None,
    yes: bool = False,
    config: Path | None = None,
    host: str = HOST,
    scpi: int = SCPI_PORT,
    web: int = WEB_PORT,
    record: Path | None = None,
    state: Path | None = None,
    port: list[str] | None = None,
    law: str | None = None,
    machine: str | None = None,
    seconds: float | None = None,
    figure: Path | None = None,
    json: bool = False,
) -> None:
    """Check whether this computer has what `macromicro serve` needs.

    The options are those of `serve`. Each problem is printed with its remedy.
    --law checks a control law of your own, --machine a machine, --open, --move or --walk a rig, and
    --seconds the timing of the loop; nothing else is checked then.
    The exit status is 1 if a check fails. Warnings do not count.
    """
    from json import dumps

    from macromicro.commands import _checking, _timing
    from macromicro.rig.board.named import board_name
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
        _timing.measure(config, seconds, figure, as_json=json)
        return
    numbers = [each for each in port or () if each.isdigit()]
    devices = [each for each in port or () if not each.isdigit()]
    rig = board_name(rig, devices[0] if devices else None, None, None)
    if machine is not None:
        findings = _checking.machine(machine)
    elif walk:
        findings = _each(rig, lambda one: _checking.check_walk(one, move, heat, yes=yes))
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
    for name in on_rig.rig_names(rig):
        for each in look(name):
            yield each._replace(what=f"{name}, {each.what}")


def _ports(scpi: int, web: int, others: Sequence[str]) -> dict[int, str]:
    """Ports to check, by number; a free one chosen by the system is always available."""
    from macromicro.errors import InputError

    check_ports({"--scpi": scpi, "--web": web})
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
