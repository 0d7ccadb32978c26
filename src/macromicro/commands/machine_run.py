"""``run`` and ``config show`` for the machines of one stage and of two axes."""

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


def in_step(config: Path) -> bool:
    """Whether a settings file is for a machine of several axes on one clock."""
    from macromicro.machines.composition import STEP
    from macromicro.machines.compositions import chosen

    return chosen(config).family == STEP


def refuse(*, fan: bool) -> None:
    if fan:
        raise ProblemError("--fan", "this machine has no fan")


def run(asked: tuple[Any, ...], as_json: bool, yes: bool, signals: Signals) -> None:
    """Run a programme on a machine of one stage or of two axes, into its folder."""
    from macromicro.commands import asking
    from macromicro.machines.job import Request
    from macromicro.runs.folder import held

    rooms = _rooms(asked[0])
    job = rooms[0].check(Request(*asked))
    asking.before_one(job, yes)
    with held(job.out, overwrite=job.request.overwrite, names=rooms[0].FILES):
        _run(job, rooms, as_json, signals)


def _rooms(config: Path) -> tuple[Any, Any, Any]:
    """Modules for job, runs and report of the machine that a file names."""
    if in_step(config):
        from macromicro.machines.joint import job as joint_job
        from macromicro.machines.joint import runs as joint_runs
        from macromicro.report import joint

        return joint_job, joint_runs, joint
    from macromicro.machines import job, runs
    from macromicro.report import stage

    return job, runs, stage


def _run(job: Any, rooms: tuple[Any, Any, Any], as_json: bool, signals: Signals) -> None:
    from datetime import datetime

    from macromicro.commands.performing import performed
    from macromicro.report import terminal
    from macromicro.report.summary import as_json as to_json

    experiment, runs, report = rooms
    if any(one.kind.plain for one in getattr(job.machine, "axes", (job.machine,))):
        words = "is plain Python: the machine runs interpreted, slower; `force` and `after` under"
        print(f"friction.part {words} @kernel are compiled", file=sys.stderr)
    elif getattr(job, "source", None) is None:  # on a rig the same period runs interpreted
        if not runs.is_compiled():
            print("compiling the machine, once, about 10 s", file=sys.stderr)
        runs.compile_machine(job.machine, job.settings, job.plan)
    signals.later()
    started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    bar = terminal.bar(job.programme.title, job.expected, lambda k: f"move {k + 1}")
    ended = performed(experiment.execute, job, bar, signals)
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
        terminal.show_lines(report.HEADINGS, report.table(ended), verdict, report.remarks(ended))
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
    """Print one axis of a machine of two as settings of the machine `axis`."""
    from macromicro.machines.joint import machine as joint
    from macromicro.machines.joint.settings import AXES, DEFAULT, of

    if axis not in AXES:
        raise InputError("--axis", axis, f"{' or '.join(AXES)}")
    settings = DEFAULT if config is None else joint.load(config)[1]
    text = joint.alone(settings, axis)
    _warn(of(settings)[AXES.index(axis)])
    print(text, end="")
