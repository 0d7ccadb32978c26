"""A run into its folder, as the commands perform it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import datetime
from typing import TYPE_CHECKING, Any

import typer

from macromicro.commands.group import compiling, tell
from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.runs.job import Request


def perform(request: Request, as_json: bool, yes: bool, signals: Signals) -> None:
    """Run a programme on a machine."""
    from macromicro.commands import asking
    from macromicro.report import terminal
    from macromicro.report.run import as_json as to_json
    from macromicro.report.write import reported, write
    from macromicro.runs import job as jobs
    from macromicro.runs.folder import held

    job = jobs.check(request)
    asking.before(job, yes)
    with held(job.out, overwrite=job.request.overwrite, names=job.setup.files):
        tell(job.settings)
        for notice in job.setup.notices(job.source):
            print(notice, file=sys.stderr)
        if job.waits:
            with compiling(job.setup.is_compiled()):
                job.setup.compile()
        signals.later()
        started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
        ended = performed(job, terminal.progress(job), signals)
        report = reported(ended, started)
        if not as_json:  # before the figures are drawn, which takes a second
            terminal.show(report, job.out)
            sys.stdout.flush()
        try:
            learned = write(ended, report)
        except OSError as error:
            reason = error.strerror or str(error)
            said = f"the report could not be written: {reason}; the recording is in {job.out}"
            say(said)
            raise typer.Exit(signals.status or 1) from None
        if as_json:
            print(to_json(report.summary), end="")
        else:
            print(f"results: {job.out}")
            if learned is not None:
                print(f"the law has learned: continue with --config {learned}")
        if report.problems:
            say("; ".join(report.problems))
        if report.problems or signals.received:
            raise typer.Exit(signals.status or 1)


def performed(
    job: Any, bar: AbstractContextManager[Callable[[float, int], None]], signals: Signals
) -> Any:
    """The run that a job describes. A signal ends the run with a whole recording and no report."""
    from macromicro.runs.job import Stop, execute

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
        say(said)
        raise typer.Exit(signals.status) from None
