"""``macromicro sweep SPEC.toml``: many variants of a job, over processes or a cluster."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from macromicro.commands.group import tell
from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.sweeps.results import Summary
    from macromicro.sweeps.run import Outcome, Ready, Request


def sweep(  # noqa: PLR0913, PLR0917 - one for each option
    spec: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    out: Path | None = None,
    overwrite: bool = False,
    law: str | None = None,
    figures: str = PNG,
    show: bool = False,
    listed: bool = False,
) -> None:
    """Compute a job for every variant of a grid or a sample.

    Samples are random, Latin hypercube or Sobol's.
    Finished variants survive any interruption; --resume computes the others.
    """
    from macromicro.errors import ProblemError

    if listed and show:
        raise ProblemError("--list", "not allowed with --show", "Choose one of them.")
    if listed:
        _list(spec)
        return
    from macromicro.drawing.files import formats
    from macromicro.sweeps.run import Request

    if spec is None:
        accepted = "Give SPEC.toml, --list, or --show with a folder."
        raise ProblemError("sweep", "no file given", accepted)
    kinds = formats(figures)
    if show:
        _draw(Path(spec), kinds)
        return
    request = Request(Path(spec), out, workers, scheduler, resume, overwrite, law=law)
    with Signals() as signals:
        try:
            _sweep(request, signals, kinds)
        except KeyboardInterrupt:  # a second signal
            say("interrupted")
            raise typer.Exit(signals.status) from None


def _sweep(request: Request, signals: Signals, kinds: Sequence[str] = (PNG,)) -> None:
    from macromicro.drawing.bar import progress
    from macromicro.report.provenance import software
    from macromicro.sweeps import run

    ready = run.check(request)
    tell(ready.base)
    signals.later()
    with progress(ready.spec.job, "variants") as pace:
        outcome = run.execute(
            ready, pace.begin, pace.add, lambda: bool(signals.received), software()
        )
    summary = outcome.summary
    if summary is None:
        _report_interruption(request, ready, outcome)
        raise typer.Exit(signals.status or 1)
    _show(ready, outcome, summary)
    _draw(ready.out, kinds)
    if summary.constant:
        paths = ", ".join(axis.path for axis in ready.spec.axes)
        say(f"no metric varies; does {ready.spec.job} use {paths}?")
    if summary.infeasible == summary.rows:
        say("every variant is infeasible")
        raise typer.Exit(signals.status or 1)


def _draw(folder: Path, kinds: Sequence[str]) -> None:
    from macromicro.sweeps import figures

    for path in figures.save(folder, kinds):
        print(f"figure: {path}")


def _report_interruption(request: Request, ready: Ready, outcome: Outcome) -> None:
    words = ["macromicro", "sweep", str(request.spec), "--out", str(ready.out), "--resume"]
    if request.scheduler is not None:
        words += ["--scheduler", request.scheduler]
    elif request.workers is not None:
        words += ["--workers", str(request.workers)]
    if request.law is not None:
        words += ["--law", request.law]
    count = ready.spec.variants
    say(
        f"interrupted; {outcome.done} of {count} variants are finished and kept; "
        f"to continue: {shlex.join(words)}"
    )


def _show(ready: Ready, outcome: Outcome, summary: Summary) -> None:
    from macromicro.drawing.bar import span
    from macromicro.sweeps.results import RESULTS, lines

    for line in lines(summary):
        print(line)
    if summary.infeasible:
        print(f"infeasible: {summary.infeasible} of {summary.rows}; {summary.first_infeasible}")
    new = outcome.done - outcome.before
    rate = f", {new / outcome.seconds:.4g}/s" if new and outcome.seconds else ""
    print(f"computed: {new} of {summary.rows} variants in {span(outcome.seconds)}{rate}")
    print(f"results: {ready.out / RESULTS}")


def _list(name: str | None) -> None:
    from macromicro import batch
    from macromicro.sweeps.subject import parameters, plain_options
    from macromicro.units import shown

    for each in [name] if name is not None else list(batch.JOBS):
        job = batch.job(each)
        print(f"{each}: {', '.join(m.name for m in job.metrics)}")
        if name is None:
            continue
        for metric in job.metrics:
            print(f"  {metric.name} [{metric.unit or '-'}]: {metric.meaning}")
        print("options:")
        for option, default in plain_options(job).items():
            print(f"  {option} = {default}")
        print("parameters (a job may not use all of them):")
        for entry in parameters(job).values():
            if isinstance(entry.value, bool | str | tuple):
                continue
            value = shown(entry.value, entry.par.unit, entry.par.shown, 6)
            print(f"  {entry.path} = {value}: {entry.par.meaning}")
