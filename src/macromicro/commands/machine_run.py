"""``run`` and ``config show`` for the machines of one stage and of several."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import typer

from macromicro.commands.signals import Signals
from macromicro.errors import InputError, ProblemError


def takes_turns(config: Path | None) -> bool:
    """Whether a settings file, or none, is for the two-stage machine."""
    if config is None:  # what no file names needs no look at the machines
        return True
    from macromicro.machines.composition import TURNS
    from macromicro.machines.compositions import chosen

    return chosen(config).family == TURNS


def refuse(*, fan: bool) -> None:
    if fan:
        raise ProblemError("--fan", "this machine has no fan")


def run(asked: tuple[Any, ...], as_json: bool, yes: bool, signals: Signals) -> None:
    """Run a programme on a machine of one stage or of several, into its folder."""
    from macromicro.commands import asking
    from macromicro.machines import job as jobs
    from macromicro.runs.folder import held

    job = jobs.check(jobs.Request(*asked))
    asking.before_one(job, yes)
    with held(job.out, overwrite=job.request.overwrite, names=job.names):
        _run(job, as_json, signals)


def _run(job: Any, as_json: bool, signals: Signals) -> None:
    from datetime import datetime

    from macromicro.commands.performing import performed
    from macromicro.machines import runs
    from macromicro.machines.job import execute
    from macromicro.report import machine as report
    from macromicro.report import terminal
    from macromicro.report.summary import as_json as to_json

    if job.source is None:  # on a rig the same period runs interpreted
        if not runs.is_compiled():
            print("compiling the machine, once, about 10 s", file=sys.stderr)
        runs.compile_machine(job.machine, job.settings, job.plan)
    signals.later()
    started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    bar = terminal.bar(job.programme.title, job.expected, lambda k: f"move {k + 1}")
    ended = performed(execute, job, bar, signals)
    try:
        content = report.write(ended, started)
    except OSError as error:
        reason = error.strerror or str(error)
        said = f"the report could not be written: {reason}; the recording is in {job.out}"
        print(f"macromicro: {said}", file=sys.stderr)
        raise typer.Exit(signals.status or 1) from None
    if as_json:
        print(to_json(content), end="")
    else:
        verdict = terminal.verdict(report.verdict(ended), job.out)
        lines = (report.headings(ended), report.table(ended), verdict, report.remarks(ended))
        terminal.show_lines(*lines)
        print(f"results: {job.out}")
    problems = report.problems(ended)
    if problems:
        print(f"macromicro: {'; '.join(problems)}", file=sys.stderr)
    if problems or signals.received:
        raise typer.Exit(signals.status or 1)


def show(name: str | None, key: str | None, law: str | None, config: Path | None = None) -> None:
    """Print a machine's default settings, or those of a file with the values derived from them."""
    from macromicro.machines import compositions

    if config is None:
        made = compositions.named(name or compositions.UNNAMED, "--machine")
        _print(made, compositions.by_default(made, law), key)
        return
    if name is not None:
        raise ProblemError("--machine", "not allowed with --config, whose file names the machine")
    made = compositions.chosen(config)
    _print(made, made.load(config, law), key)


def _print(made: Any, settings: Any, key: str | None) -> None:
    from macromicro.machines.composition import TURNS

    text = made.as_toml(settings, key)
    if made.family != TURNS:
        _warn(settings, key)
    print(text, end="")


def _warn(settings: Any, key: str | None = None) -> None:
    from macromicro.machines import doubts

    for each in doubts.found(settings):
        if key is None or f"{each.path}.".startswith(f"{key}."):
            print(f"# warning: {each.text}")


def show_axis(config: Path | None, axis: str) -> None:
    """Print one stage of a machine of several as settings of a machine of its own."""
    from macromicro.machines import composite, compositions
    from macromicro.machines.machine import JOINT, as_toml

    if config is None:
        machine, settings = (found := compositions.machine(JOINT, "machine")), found.settings
    else:
        machine, settings = compositions.load(config)
    names = composite.names(machine)
    if axis not in names or names == ("",):
        raise InputError("--axis", axis, " or ".join(names) or "a machine of several stages")
    k = names.index(axis)
    tree, one = machine.trees(settings)[k], machine.stages[k][1]
    _warn(tree)
    print(as_toml(one, tree), end="")
