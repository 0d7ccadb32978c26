"""A sweep from its spec to its results: checked first, then computed, then written in order."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.batch import cores
from macromicro.errors import InputError
from macromicro.recording import check_space
from macromicro.runs import folder as runs
from macromicro.schema.text import printable
from macromicro.sweep import cluster, folder, local, results
from macromicro.sweep.origin import code
from macromicro.sweep.spec import Spec, load
from macromicro.sweep.todo import Todo
from macromicro.sweep.work import FACTORY, Task, factory

if TYPE_CHECKING:
    from distributed import Client

    from macromicro.batch import Metric

Begin = Callable[[int, int], None]
MAX_WORKERS = 1024


class Request(NamedTuple):
    """What is asked for.

    Attributes
    ----------
    spec : Path
        The sweep's file.
    out : Path, optional
        None for results/NAME of the spec.
    workers : int, optional
        None for one per core.
    scheduler : str, optional
        Address of a cluster's, instead of processes here.
    resume, overwrite : bool
        Go on with what is in `out`; replace it.
    factory : str
        Where jobs come from, "module:function".
    law : str, optional
        The macro-stage's; None for that of the settings.
    """

    spec: Path
    out: Path | None = None
    workers: int | None = None
    scheduler: str | None = None
    resume: bool = False
    overwrite: bool = False
    factory: str = FACTORY
    law: str | None = None


class Ready(NamedTuple):
    """A sweep that can begin: its folder is made.

    Attributes
    ----------
    task : Task
        What workers must know.
    metrics : sequence of Metric
        All of the job's.
    out : Path
        The folder.
    workers : int
        Processes.
    client : distributed.Client or None
        Of the cluster, where there is one.
    """

    task: Task
    metrics: Sequence[Metric]
    out: Path
    workers: int
    client: Client | None


class Outcome(NamedTuple):
    """How a sweep ended.

    Attributes
    ----------
    done, before : int
        Finished variants, and those of them that were finished before.
    seconds : float
        That this time took.
    written : Written or None
        None where it was stopped before all were finished.
    """

    done: int
    before: int
    seconds: float
    written: results.Written | None


def check(request: Request) -> Ready:
    """See everything that can be wrong before the first variant, and make the folder.

    Parameters
    ----------
    request : Request
        What is asked for.

    Returns
    -------
    Ready
        To be executed.

    Raises
    ------
    InputError
        The options, the spec, a package that is missing, a scheduler that does not answer or whose
        workers have other code, a folder that must not be written to, a full disk. Nothing existing
        is touched then.
    """
    if request.resume and request.overwrite:
        raise InputError("--resume", "beside --overwrite", "one of them")
    if request.scheduler is not None and request.workers is not None:
        raise InputError("--workers", "beside --scheduler", "one of them")
    workers = cores() if request.workers is None else request.workers
    if not 1 <= workers <= MAX_WORKERS:
        raise InputError("--workers", workers, f"a whole number from 1 to {MAX_WORKERS}")
    results.require()
    make = factory(request.factory)
    spec, text = load(request.spec, make, request.law)
    metrics = make(spec.job, **dict(spec.options)).metrics
    out = Path("results") / request.spec.stem if request.out is None else request.out
    _check_place(out, spec, resume=request.resume)
    ours = code()
    client = None if request.scheduler is None else cluster.connect(request.scheduler, ours)
    how = {"resume": request.resume, "overwrite": request.overwrite}
    try:
        folder.prepare(out, spec, text, ours, **how)
    except BaseException:
        if client is not None:
            client.close()
        raise
    return Ready(Task(spec, request.factory, ours), metrics, out, workers, client)


def _check_place(out: Path, spec: Spec, *, resume: bool) -> None:
    runs.named(out)
    # What is finished of a sweep that is resumed shows its journal, later.
    begun = resume and (out / folder.SUMMARY).exists()
    check_space(out, 0 if begun else folder.needed_bytes(spec, spec.variants))


def execute(
    ready: Ready,
    begin: Begin,
    report: local.Report,
    stop: local.Stop,
    software: Sequence[tuple[str, str]] = (),
) -> Outcome:
    """Compute what is not finished yet, then write results and summary.

    Parameters
    ----------
    ready : Ready
        From `check`.
    begin : callable
        Told how many variants there are and are finished already.
    report : callable
        Told variants and impossible ones of every finished block.
    stop : callable
        True to end early.
    software : sequence of (str, str)
        What it was made with, for the summary.

    Returns
    -------
    Outcome
        How it ended.

    Raises
    ------
    InputError
        The disk has no room for what is missing, or the folder was given to another sweep.
    SweepError
        It cannot go on; what is finished is kept.
    """
    try:
        with folder.alone(ready.out):
            # Another sweep may have been given the folder since it was prepared.
            where = f"--out {printable(ready.out, 300)}"
            if folder.summary(ready.out, where)["digest"] != ready.task.spec.digest:
                raise InputError(where, "given to another sweep meanwhile", "another folder")
            return _execute(ready, begin, report, stop, software)
    finally:
        if ready.client is not None:
            ready.client.close()


def _execute(
    ready: Ready,
    begin: Begin,
    report: local.Report,
    stop: local.Stop,
    software: Sequence[tuple[str, str]],
) -> Outcome:
    spec, place = ready.task.spec, ready.out / folder.JOURNAL
    started, clock = datetime.now().astimezone(), time.monotonic()
    record = folder.summary(ready.out, str(ready.out))
    if record["state"] == "complete" and (ready.out / folder.RESULTS).exists():
        begin(spec.variants, spec.variants)
        folder.drop_journal(ready.out)
        return Outcome(spec.variants, spec.variants, 0.0, results.restored(record["results"]))
    todo = Todo(spec.variants, folder.spans(folder.journals(ready.out), spec))
    before = spec.variants - todo.left
    check_space(ready.out, folder.needed_bytes(spec, todo.left))
    begin(spec.variants, before)
    if todo:
        if ready.client is None:
            local.run(ready.task, todo, place, ready.workers, report, stop)
        else:
            cluster.run(ready.client, ready.task, todo, place, report, stop)
    done = folder.spans(folder.journals(ready.out), spec)
    finished = int((done[:, 1] - done[:, 0]).sum())
    seconds = time.monotonic() - clock
    if finished < spec.variants:
        return Outcome(finished, before, seconds, None)
    path = ready.out / folder.RESULTS
    made = ready.task.code or code()
    written = results.write(path, spec, ready.metrics, folder.journals(ready.out), made, stop)
    if written is None:
        return Outcome(finished, before, seconds, None)
    summary: dict[str, Any] = {
        "state": "complete",
        **folder.origin(spec, made),
        "results": results.as_json(written, ready.metrics),
        "started": started.isoformat(sep=" ", timespec="seconds"),
        "seconds": round(seconds, 3),
        "finished_before": before,
        "workers": ready.workers if ready.client is None else "cluster",
        "software": dict(software),
    }
    folder.write_json(ready.out / folder.SUMMARY, summary)
    folder.drop_journal(ready.out)
    return Outcome(finished, before, seconds, written)
