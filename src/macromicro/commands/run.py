"""``macromicro run PROGRAMME``: a motion programme on a machine, into a folder; the examples."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from macromicro.commands.group import compiling, tell
from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.runs.job import Request


def run(  # noqa: PLR0913, PLR0917 - a parameter for each option
    programme: str | None = None,
    out: Path | None = None,
    config: Path | None = None,
    cycles: int = 1,
    fan: bool = False,
    seed: int = 0,
    rig: str = "twin",
    port: str | None = None,
    loop: str | None = None,
    calibration: Path | None = None,
    law: str | None = None,
    yes: bool = False,
    figures: str = PNG,
    as_json: bool = False,
    overwrite: bool = False,
) -> None:
    """Run a motion programme on the simulated machine or on a rig.

    --config names the machine. Without a programme the thesis' integrated test (Chapter 6) runs.
    On replay:FILE nothing moves: controller and guard read the sensors of that recording, to its
    end. On your own rig the command prints what will move and asks first. A settings file with
    machine = "axis" is for one motor-driven axis, machine = "xy" for two with
    coordinated motion (docs/machines.md).
    """
    from macromicro.drawing.files import formats
    from macromicro.rig.board.named import board_name
    from macromicro.runs.job import Request

    with Signals() as signals:
        try:
            kinds = formats(figures)
            rig = board_name(rig, port, loop, calibration)
            request = Request(programme, out, config, cycles, fan, seed, overwrite, rig, kinds, law)
            perform(request, as_json, yes, signals)
        except KeyboardInterrupt:
            say("interrupted")
            raise typer.Exit(signals.status) from None


def programmes(name: str | None = None) -> None:
    """List the example programmes, or print one."""
    from macromicro import programme
    from macromicro.errors import InputError
    from macromicro.schema.text import printable

    examples = programme.shipped()
    if name is None:
        for each, path in examples.items():
            first = path.read_text(encoding="utf-8").partition("\n")[0]
            print(f"{each:14}{first.lstrip('# ')}")
        return
    if name not in examples:
        raise InputError("programme", printable(name), f"one of {', '.join(examples)}")
    print(examples[name].read_text(encoding="utf-8"), end="")


def perform(request: Request, as_json: bool, yes: bool, signals: Signals) -> None:
    """Run a programme on a machine."""
    from macromicro.commands import asking
    from macromicro.report import terminal
    from macromicro.report.run import as_json as to_json
    from macromicro.report.write import run_report, write
    from macromicro.runs import job as jobs
    from macromicro.runs.folder import locked

    job = jobs.check(request)
    asking.before(job, yes)
    with locked(job.out, overwrite=job.request.overwrite, names=job.setup.files):
        tell(job.settings)
        for notice in job.setup.notices(job.source):
            print(notice, file=sys.stderr)
        if job.waits:
            with compiling(job.setup.is_compiled()):
                job.setup.compile()
        signals.later()
        started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
        ended = perform_job(job, terminal.progress(job), signals)
        report = run_report(ended, started)
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


def perform_job(
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
