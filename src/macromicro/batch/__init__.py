"""Many variants of a run at once: the step functions of single runs, over threads.

    job = batch.job("macro-bench")
    gains = batch.Variants(("controller.pd_tuned.now", "controller.pd_tuned.before"), values)
    for first, metrics in batch.run(job, gains):
        ...

A job turns variants, values at dotted paths of its parameter tree, into metrics; no
recording is kept. Each variant gives the same bits as a single run with its parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from macromicro.batch._engine import cores, run, trajectories
from macromicro.batch.variants import SEED, Job, Metric, Trajectories, Variants
from macromicro.errors import InputError
from macromicro.schema import plugins
from macromicro.schema.text import is_toml

__all__ = [
    "JOBS",
    "SEED",
    "Job",
    "Metric",
    "Trajectories",
    "Variants",
    "cores",
    "job",
    "run",
    "trajectories",
]


def _macro_bench(**options: Any) -> Job:
    from macromicro.batch.macro_bench import MacroBenchJob

    return MacroBenchJob(**options)


def _micro_bench(**options: Any) -> Job:
    from macromicro.batch.micro_bench import MicroBenchJob

    return MicroBenchJob(**options)


def _programme(**options: Any) -> Job:
    from macromicro.batch.machine_jobs import ProgrammeJob

    return ProgrammeJob(**options)


def _stage(machine: str) -> Callable[..., Job]:
    def make(**options: Any) -> Job:
        from macromicro.batch.machine_jobs import StageJob

        return StageJob(machine, **options)

    return make


JOBS: dict[str, Callable[..., Job]] = {
    "macro-bench": _macro_bench,
    "micro-bench": _micro_bench,
    "programme": _programme,
    **{machine: _stage(machine) for machine in ("axis", "piezo", "wire", "rotary", "xy")},
}


def job(name: str, **options: Any) -> Job:
    """Make a job.

    Parameters
    ----------
    name : str
        Of `JOBS`, the machine of another package, as "module:machine", or the settings file of a
        machine.
    **options : Any
        Of the job.

    Returns
    -------
    Job
        For `run`.

    Raises
    ------
    InputError
        An unknown name, or options that the job refuses.

    Examples
    --------
    >>> from macromicro import batch
    >>> job = batch.job("macro-bench")
    >>> [metric.name for metric in job.metrics][:3]
    ['settling_time', 'rise_time', 'overshoot']
    """
    if name in JOBS:
        return JOBS[name](**options)
    if plugins.spelled(name) or is_toml(name):
        return _stage(name)(**options)
    accepted = f"{' or '.join(JOBS)}; MODULE:MACHINE of your own; or a machine's file (.toml)"
    raise InputError("job", name, accepted)
