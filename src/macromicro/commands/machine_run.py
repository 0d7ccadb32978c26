"""``run`` and ``config show`` for the machines of one stage."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import typer

from macromicro.commands.signals import Signals
from macromicro.errors import InputError


def other(config: Path) -> bool:
    """Whether a settings file names another machine than the thesis' two-stage one."""
    from macromicro.machines.machine import chosen

    return chosen(config) is not None


def refuse(*, fan: bool, rig: str) -> None:
    """InputError for options that only the two-stage machine has."""
    if fan:
        raise InputError("--fan", "", "nothing: this machine has no fan")
    if rig != "twin":
        raise InputError("--rig", rig, "twin for this machine")


def run(asked: tuple[Any, ...], as_json: bool, signals: Signals) -> None:
    """Run a programme on a machine of one stage, into its folder."""
    from macromicro.machines import job as experiment
    from macromicro.runs.folder import held

    job = experiment.check(experiment.Request(*asked))
    with held(job.out, overwrite=job.request.overwrite, names=experiment.FILES):
        _run(job, as_json, signals)


def _run(job: Any, as_json: bool, signals: Signals) -> None:
    from datetime import datetime

    from macromicro.machines import job as experiment
    from macromicro.machines import runs
    from macromicro.report import stage, terminal
    from macromicro.report.summary import as_json as to_json
    from macromicro.runs.job import Stop

    if not runs.is_compiled():
        print("compiling the machine, once, about 5 s", file=sys.stderr)
    runs.compile_machine(job.machine, job.settings, job.plan)
    signals.later()
    started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    with terminal.bar(job.programme.title, job.expected, lambda k: f"move {k + 1}") as report:

        def step(t: float, move: int) -> None:
            report(t, move)
            if signals.received:
                raise Stop

        ended = experiment.execute(job, step)
    try:
        content = stage.write(ended, started)
    except OSError as error:
        reason = error.strerror or str(error)
        said = f"the report could not be written: {reason}; the recording is in {job.out}"
        print(f"macromicro: {said}", file=sys.stderr)
        raise typer.Exit(signals.status or 1) from None
    if as_json:
        print(to_json(content), end="")
    else:
        terminal.show_lines(stage.HEADINGS, stage.table(ended), stage.remarks(ended))
        print(f"results: {job.out}")
    problems = stage.problems(ended)
    if problems:
        print(f"macromicro: {'; '.join(problems)}", file=sys.stderr)
    if problems or signals.received:
        raise typer.Exit(signals.status or 1)


def show(name: str, key: str | None, law: str | None) -> None:
    """Print a machine's default settings."""
    from macromicro.machines.machine import as_toml, named
    from macromicro.machines.tree import joined

    machine = named(name, "--machine")
    assert machine is not None  # the two-stage machine is shown elsewhere
    settings = machine.settings if law is None else joined(machine.settings, law, "--law")
    print(as_toml(machine, settings, key), end="")
