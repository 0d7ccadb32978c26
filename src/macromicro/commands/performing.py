"""A run into its folder, as the commands perform it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import datetime
from typing import Any

import typer

from macromicro.commands.group import compiling, tell
from macromicro.commands.signals import Signals


def bench(request: tuple[Any, ...], as_json: bool, yes: bool, signals: Signals) -> None:
    """Run a programme on the two-stage machine."""
    from macromicro import simulate
    from macromicro.commands import asking
    from macromicro.runs import job as experiment
    from macromicro.runs.folder import LEARNED

    job = experiment.check(experiment.Request(*request))
    asking.before(job, yes)

    def prepare() -> None:
        tell(job.settings.controller)
        asked = (job.settings, job.programme, job.request.fan)
        if job.source is None and not simulate.runs_interpreted(*asked):
            with compiling(simulate.is_compiled()):
                simulate.compile_bench(*asked)
        if job.recalibrate:
            print("another Hall sensor: calibrating it on this bench first", file=sys.stderr)

    def more() -> None:
        if (learned := job.out / LEARNED).exists():
            print(f"the law has learned: continue with --config {learned}")

    _run(experiment.execute, job, prepare, as_json, signals, more)


def machine(request: tuple[Any, ...], as_json: bool, yes: bool, signals: Signals) -> None:
    """Run a programme on a machine of one stage, or of several on one clock."""
    from macromicro.commands import asking
    from macromicro.machines import job as jobs
    from macromicro.machines import runs

    job = jobs.check(jobs.Request(*request))
    asking.before_one(job, yes)

    def prepare() -> None:
        asked = (job.machine, job.settings, job.plan)
        # On a rig the same period runs interpreted.
        if job.source is None and not runs.runs_interpreted(*asked):
            with compiling(runs.is_compiled()):
                runs.compile_machine(*asked)

    _run(jobs.execute, job, prepare, as_json, signals)


def _run(
    execute: Callable[[Any, Callable[[float, int], None]], Any],
    job: Any,
    prepare: Callable[[], None],
    as_json: bool,
    signals: Signals,
    more: Callable[[], None] = lambda: None,
) -> None:
    from macromicro.report import terminal
    from macromicro.report.run import as_json as to_json
    from macromicro.report.write import reported, write
    from macromicro.runs.folder import held

    with held(job.out, overwrite=job.request.overwrite, names=job.names):
        prepare()
        signals.later()
        started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
        ended = performed(execute, job, terminal.progress(job), signals)
        report = reported(ended, started)
        if not as_json:  # before the figures are drawn, which takes a second
            terminal.show(report, job.out)
            sys.stdout.flush()
        try:
            write(ended, report)
        except OSError as error:
            reason = error.strerror or str(error)
            said = f"the report could not be written: {reason}; the recording is in {job.out}"
            print(f"macromicro: {said}", file=sys.stderr)
            raise typer.Exit(signals.status or 1) from None
        if as_json:
            print(to_json(report.summary), end="")
        else:
            print(f"results: {job.out}")
            more()
        if report.problems:
            print(f"macromicro: {'; '.join(report.problems)}", file=sys.stderr)
        if report.problems or signals.received:
            raise typer.Exit(signals.status or 1)


def performed(
    execute: Callable[[Any, Callable[[float, int], None]], Any],
    job: Any,
    bar: AbstractContextManager[Callable[[float, int], None]],
    signals: Signals,
) -> Any:
    """The result of `execute`. A signal ends the run with a whole recording and no report."""
    from macromicro.runs.job import Stop

    reached = 0.0
    try:
        with bar as report:

            def step(t: float, move: int) -> None:
                nonlocal reached
                reached = t
                report(t, move)
                if signals.received:
                    signals.ignore()
                    raise Stop

            return execute(job, step)
    except Stop:
        said = f"interrupted at {reached:.3f} s; the recording is in {job.out}"
        print(f"macromicro: {said}", file=sys.stderr)
        raise typer.Exit(signals.status) from None
