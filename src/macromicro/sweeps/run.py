"""A sweep from its spec to its results: check, compute, write in order."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.batch import cores
from macromicro.errors import InputError, ProblemError
from macromicro.recording import check_space
from macromicro.runs import folder as runs
from macromicro.schema.text import printable
from macromicro.sweeps import _cluster, _local, folder, results
from macromicro.sweeps._origin import code
from macromicro.sweeps._spec import Spec, load
from macromicro.sweeps._todo import Todo
from macromicro.sweeps.work import FACTORY, Task, factory

if TYPE_CHECKING:
    from distributed import Client

    from macromicro.batch import Metric

Begin = Callable[[int, int], None]
MAX_WORKERS = 1024


class Request(NamedTuple):
    spec: Path  # the sweep's file
    out: Path | None = None  # None for results/NAME of the spec
    workers: int | None = None  # None for one per core
    scheduler: str | None = None  # address of a cluster's, instead of processes here
    resume: bool = False  # go on with what is in `out`
    overwrite: bool = False  # replace it
    factory: str = FACTORY  # where jobs come from, "module:function"
    law: str | None = None  # the macro-stage's; None for that of the settings


class Ready(NamedTuple):
    task: Task  # what workers must know
    metrics: Sequence[Metric]  # all of the job's
    out: Path  # the folder
    workers: int  # processes
    client: Client | None  # of the cluster, where there is one


class Outcome(NamedTuple):
    # done, before: finished variants, and those of them that were finished before
    done: int
    before: int
    seconds: float  # that this time took
    written: results.Written | None  # None where it was stopped before all were finished


def check(request: Request) -> Ready:
    if request.resume and request.overwrite:
        raise ProblemError("--resume", "not allowed with --overwrite", "Choose one of them.")
    if request.scheduler is not None and request.workers is not None:
        raise ProblemError("--workers", "not allowed with --scheduler", "Choose one of them.")
    workers = cores() if request.workers is None else request.workers
    if not 1 <= workers <= MAX_WORKERS:
        raise InputError("--workers", workers, f"a whole number from 1 to {MAX_WORKERS}")
    results.require()
    make = factory(request.factory)
    spec, text = load(request.spec, make, request.law)
    metrics = make(spec.job, **dict(spec.options)).metrics
    usual = Path("results") / request.spec.stem
    out = runs.chosen(request.out, usual, overwrite=request.overwrite, resume=request.resume)
    _check_place(out, spec, resume=request.resume)
    ours = code()
    client = None if request.scheduler is None else _cluster.connect(request.scheduler, ours)
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
    report: _local.Report,
    stop: _local.Stop,
    software: Sequence[tuple[str, str]] = (),
) -> Outcome:
    try:
        with folder.alone(ready.out):
            # Another sweep may have been given the folder since it was prepared.
            where = f"--out {printable(ready.out, 300)}"
            if folder.summary(ready.out, where)["digest"] != ready.task.spec.digest:
                raise ProblemError(
                    where, "another sweep has taken the folder", "Choose another one."
                )
            return _execute(ready, begin, report, stop, software)
    finally:
        if ready.client is not None:
            ready.client.close()


def _execute(
    ready: Ready,
    begin: Begin,
    report: _local.Report,
    stop: _local.Stop,
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
            _local.run(ready.task, todo, place, ready.workers, report, stop)
        else:
            _cluster.run(ready.client, ready.task, todo, place, report, stop)
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
