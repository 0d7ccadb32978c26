"""A sweep from its spec to its results: check, compute, write."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from macromicro.batch import cores
from macromicro.errors import InputError, ProblemError
from macromicro.extras import require
from macromicro.runs import folder as runs
from macromicro.sweeps import _cluster, results
from macromicro.sweeps._evaluate import (
    FACTORY,
    KEPT,
    Computed,
    Part,
    SweepError,
    Task,
    by_cluster,
    by_processes,
    factory,
)  # fmt: skip
from macromicro.sweeps._folder import FILES, Folder
from macromicro.sweeps._provenance import Provenance, provenance
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import Spec, load

if TYPE_CHECKING:
    from distributed import Client

Begin = Callable[[int, int], None]
Report = Callable[[int, int], None]
Stop = Callable[[], bool]
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
    request: Request
    spec: Spec
    text: str  # of the sweep's file
    base: object  # settings that variants start from
    provenance: Provenance
    folder: Folder
    workers: int  # processes
    client: Client | None  # of the cluster, where there is one

    @property
    def out(self) -> Path:
        return self.folder.place

    def resumed(self) -> bool:
        return self.folder.resumed(resume=self.request.resume, overwrite=self.request.overwrite)


class Outcome(NamedTuple):
    # done, before: finished variants, and those of them that were finished before
    done: int
    before: int
    seconds: float  # that this time took
    summary: results.Summary | None  # None where it was stopped before all were finished


def check(request: Request) -> Ready:
    """Refuse what cannot be done; leaves the disk as it is."""
    if request.resume and request.overwrite:
        raise ProblemError("--resume", "not allowed with --overwrite", "Choose one of them.")
    if request.scheduler is not None and request.workers is not None:
        raise ProblemError("--workers", "not allowed with --scheduler", "Choose one of them.")
    workers = cores() if request.workers is None else request.workers
    if not 1 <= workers <= MAX_WORKERS:
        raise InputError("--workers", workers, f"a whole number from 1 to {MAX_WORKERS}")
    require("a sweep", "pyarrow", "sweep")
    spec, text = load(request.spec, factory(request.factory), request.law)
    job = factory(request.factory)(spec.job, **dict(spec.options))
    usual = Path("results") / request.spec.stem
    out = runs.choose_folder(request.out, usual, overwrite=request.overwrite, resume=request.resume)
    ours = provenance()
    folder = Folder(out, spec, job.metrics, ours)
    ready = Ready(request, spec, text, job.base(), ours, folder, workers, None)
    needed = folder.needed_bytes(folder.count)
    if ready.resumed():
        needed = 0 if folder.completed() else folder.needed_bytes(len(folder.missing()))
    runs.check(out, needed, overwrite=True, names=FILES)
    if request.scheduler is None:
        return ready
    return ready._replace(client=_cluster.connect(request.scheduler, ours))


def execute(
    ready: Ready, begin: Begin, report: Report, stop: Stop, software: Sequence[tuple[str, str]] = ()
) -> Outcome:
    """Compute what is missing; `begin` gets the number of variants and of finished ones."""
    try:
        with runs.locked(ready.out, overwrite=True, names=FILES):
            # Another sweep may have used the folder since it was checked.
            if not ready.resumed():
                ready.folder.begin(ready.text)
            return _execute(ready, begin, report, stop, software)
    finally:
        if ready.client is not None:
            ready.client.close()


def _execute(
    ready: Ready, begin: Begin, report: Report, stop: Stop, software: Sequence[tuple[str, str]]
) -> Outcome:
    variants, folder = ready.spec.variants, ready.folder
    started, clock = datetime.now().astimezone(), time.monotonic()
    if summary := folder.completed():
        begin(variants, variants)
        folder.drop_parts()
        return Outcome(variants, variants, 0.0, summary)
    missing = folder.missing()
    before = done = variants - sum(folder.span(number)[1] for number in missing)
    begin(variants, before)
    try:
        with closing(_compute(ready, missing, stop)) as computed:
            for part, block in computed:
                folder.write_part(part, block)
                done += len(block.rows)
                report(len(block.rows), len(block.errors))
        seconds = time.monotonic() - clock
        summary = folder.write_results(stop) if done == variants else None
        if summary is None:
            return Outcome(done, before, seconds, None)
        facts = {
            "started": started.isoformat(sep=" ", timespec="seconds"),
            "seconds": round(seconds, 3),
            "finished_before": before,
            "workers": ready.workers if ready.client is None else "cluster",
            "software": dict(software),
        }
        folder.complete(summary, facts)
    except OSError as error:  # a full disk
        raise SweepError(f"{ready.out}: {error.strerror or error}. {KEPT}") from None
    return Outcome(done, before, seconds, summary)


def _compute(ready: Ready, missing: Sequence[int], stop: Stop) -> Computed:
    sampler = Sampler(ready.spec)

    def draw(number: int) -> Part:
        first, count = ready.folder.span(number)
        return Part(number, first, sampler.variants(first, count))

    task = Task(ready.request.factory, ready.spec._replace(axes=()), ready.provenance)
    if ready.client is not None:
        return by_cluster(ready.client, task, missing, draw, stop)
    return by_processes(task, missing, draw, ready.workers, stop)
