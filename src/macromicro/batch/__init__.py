"""Many variants of a run at once: the step functions of single runs, over threads.

    job = batch.job("macro-bench")
    gains = batch.Variants(("controller.pd_tuned.now", "controller.pd_tuned.before"), values)
    for first, metrics in batch.run(job, gains):
        ...

A job turns variants, values at dotted paths of its parameter tree, into metrics; no
recording is kept. Each variant gives the same bits as a single run with its parameters.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from macromicro.batch._engine import cores, run
from macromicro.batch.variants import SEED, Job, Metric, Variants
from macromicro.errors import InputError
from macromicro.schema import plugins
from macromicro.schema.text import is_toml

__all__ = [
    "JOBS",
    "SEED",
    "Job",
    "Metric",
    "Variants",
    "cores",
    "job",
    "run",
]


# Classes of the jobs that have a name of their own, within this package.
_OWN = {
    "macro-bench": ("macro_bench", "MacroBenchJob"),
    "micro-bench": ("micro_bench", "MicroBenchJob"),
    "programme": ("programme_job", "ProgrammeJob"),
}
_MACHINES = ("axis", "piezo", "wire", "rotary", "xy")
JOBS = (*_OWN, *_MACHINES)


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
    if name in _OWN:
        module, kind = _OWN[name]
        made: Job = getattr(import_module(f"{__name__}.{module}"), kind)(**options)
        return made
    if name in _MACHINES or plugins.is_plugin_name(name) or is_toml(name):
        from macromicro.batch.stage_job import StageJob

        return StageJob(name, **options)
    accepted = f"{' or '.join(JOBS)}; MODULE:MACHINE of your own; or a machine's file (.toml)"
    raise InputError("job", name, accepted)
