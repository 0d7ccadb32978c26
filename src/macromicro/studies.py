"""Studies of many runs from Python, for any machine: tune, robust, sweep."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from macromicro import tuning
from macromicro.api import PathLike
from macromicro.arrays import Array
from macromicro.batch import cores
from macromicro.errors import InputError, ProblemError
from macromicro.machines import composite, compositions, doubts, programmes
from macromicro.machines.composite import AnyMachine
from macromicro.machines.composition import TURNS
from macromicro.machines.machine import Machine
from macromicro.robustness import job as jobs
from macromicro.robustness import stage as machine_study
from macromicro.robustness import study
from macromicro.robustness.statistics import Share
from macromicro.schema import config, keys
from macromicro.schema.text import printable
from macromicro.settings import Settings
from macromicro.settings import chosen as bench_settings
from macromicro.tuning import joint, joint_files, stage_files
from macromicro.tuning import stage as stages

if TYPE_CHECKING:
    import pyarrow as pa

OTHERS, FRESH = 8, 50  # machines of a robust search, and to judge it by
MOST = 1000  # of them
MAX_WORKERS = 256
MAX_DESIGNS = 1_000_000

Progress = Callable[[int, float], None]


class Tuned(NamedTuple):
    """Result of `tune`."""

    settings: Any  #: with the gains found; the given ones where none were better
    better: bool  #: whether the cost is lower than before
    #: before, after: figures of the machine's run by name, under the given gains and these
    before: dict[str, float]
    after: dict[str, float]
    evaluations: int  #: designs that were tried


class Robustness(NamedTuple):
    """Result of `robust`: a row for each machine that was drawn."""

    #: what was varied, by name: a value for each machine, as in the table of uncertain parameters
    parameters: dict[str, Array]
    #: figures of the runs by name: infinity where a machine never settles, NaN where it is unknown
    figures: dict[str, Array]
    nominal: dict[str, float]  #: the same figures of the settings themselves
    units: dict[str, str]  #: of the figures
    arrived: Share  #: machines on which all moves arrive, with the bounds of the true share


class Tuner(NamedTuple):
    """How a machine with settings of its own is tuned."""

    names: tuple[str, ...]  # that it answers to
    search: Callable[[stages.Objective, stages.Budget, Progress], Any]
    files: Any  # module that writes its results
    fewest: int  # designs of a search

    def check(self, stage: str | None, evaluations: int) -> None:
        """Refuse a name that the machine does not have, and too few designs."""
        if stage is not None and stage not in self.names:
            raise InputError("stage", stage, f"{self.names[0]} for this machine")
        keys.whole(evaluations, self.fewest, MAX_DESIGNS, "--evaluations")


def tuner(machine: AnyMachine, settings: Any, where: str) -> Tuner:
    """The search for gains of a machine of one stage, or of several on one clock."""
    doubts.refuse(settings, where, "tune")
    plan = programmes.plan(machine, settings, programmes.chosen(machine, settings))
    if not isinstance(machine, Machine):
        search = partial(joint.search, machine, settings, plan)
        return Tuner((machine.name,), search, joint_files, joint.fewest(machine))
    place = machine.kind.place

    def search_one(aim: stages.Objective, budget: stages.Budget, tell: Progress) -> Any:
        return stages.search(machine, settings, plan, stages.named(aim.name, place), budget, tell)

    names = machine.kind.name, machine.name, "macro"
    return Tuner(names, search_one, stage_files, stages.LEAST)


def tune(
    what: PathLike | None = None,
    stage: str | None = None,
    *,
    objective: str = "settling",
    law: str | None = None,
    evaluations: int = 300,
    seed: int = 0,
    benches: int = 0,
    settings: Any = None,
    progress: Progress = lambda done, best: None,
) -> Tuned:
    """Search for better gains of any machine, as ``macromicro tune`` does, and write no file.

    Parameters
    ----------
    what : PathLike | None, optional
        Settings file of the machine; default: the two-stage machine.
    stage : str | None, optional
        "macro" or "micro", of the two-stage machine; of others not needed.
    objective : str, optional
        What is minimised: settling, iae or effort on the two-stage machine; settling, error or
        rest on others.
    law : str | None, optional
        Control law, or "MODULE:LAW" of your own; default: that of the settings.
    evaluations : int, optional
        Designs to try at most.
    seed : int, optional
        Seed of the search.
    benches : int, optional
        Number of varied machines to search on beside the nominal one; what was found is then
        judged on fresh ones. Not for machines of several stages on one clock.
    settings : Any, optional
        Settings of the machine; default: those of its file.
    progress : Callable[[int, float], None], optional
        Hears the number of designs tried and the least cost so far.

    Returns
    -------
    Tuned
        Settings with the best gains found, and what they gain.

    Raises
    ------
    InputError
        An argument or the settings are not accepted.
    """
    if _is_two_stage(what):
        if stage is None:
            raise ProblemError("stage", "missing", "Give macro or micro.")
        request = tuning.Request(
            stage, objective, law, evaluations, seed, _bench(what, None, settings),
            robust=benches > 0, benches=benches or None,
        )  # fmt: skip
        found = tuning.tune(request, progress)
        before, after = (dict(shown.metrics) for shown in found.bench)
        return Tuned(found.tuned, found.better, before, after, found.evaluations)
    machine, own = _machine(what, law, settings)
    how = tuner(machine, own, "settings" if what is None else printable(what, 300))
    how.check(stage, evaluations)
    if benches and not isinstance(machine, Machine):
        raise ProblemError("benches", "a machine of several stages is searched on its own sheets")
    keys.seed(seed, "seed")
    budget = stages.Budget(evaluations, seed, benches, FRESH if benches else 0, cores())
    found = how.search(stages.named(objective), budget, progress)
    if isinstance(machine, Machine):
        before, after = found.before[0], found.after[0]
        tuned = found.tuned
    else:
        before, after, tuned = found.versions[0].found, found.best.found, found.best.settings
    return Tuned(tuned, found.better, before._asdict(), after._asdict(), found.evaluations)


def robust(
    what: PathLike | None = None,
    programme: str | None = None,
    *,
    samples: int = 200,
    seed: int = 0,
    law: str | None = None,
    settings: Any = None,
    workers: int | None = None,
    progress: Callable[[int], bool] = lambda done: False,
) -> Robustness:
    """Run a programme on machines that differ from the nominal one, as ``macromicro robust`` does.

    Parameters
    ----------
    what : PathLike | None, optional
        Settings file of the machine, of any kind; default: the two-stage machine.
    programme : str | None, optional
        A programme's file, or the name of an example; default: the machine's usual moves, or
        "thesis".
    samples : int, optional
        Number of machines.
    seed : int, optional
        Seed of the sample and of the sensors' noise.
    law : str | None, optional
        Control law, or "MODULE:LAW" of your own; default: that of the settings.
    settings : Any, optional
        Nominal settings; default: those of the file.
    workers : int | None, optional
        Number of threads; default: one for each core.
    progress : Callable[[int], bool], optional
        Hears the number of finished runs; returns whether to end early with those.

    Returns
    -------
    Robustness
        Parameters and figures of each machine.

    Raises
    ------
    InputError
        An argument, the programme or the settings are not accepted.
    """
    keys.seed(seed, "seed")
    count = threads(workers, "workers")
    if _is_two_stage(what):
        own = _bench(what, law, settings)
        subject = jobs.subject(jobs.RobustJob(programme or "thesis", settings=own), count)
    else:
        machine, own = _machine(what, law, settings)
        plan = programmes.plan(machine, own, programmes.chosen(machine, own, programme))
        subject = machine_study.subject(machine, own, plan, count)
    request = study.Request(own, (), samples, seed, single=False)
    found = study.run(request, subject, lambda done, total: progress(done))
    names = [each.name for each in subject.metrics]
    varied = [each.name for each in subject.uncertain]
    return Robustness(
        dict(zip(varied, found.sample.amounts[: len(found.rows)].T, strict=True)),
        dict(zip(names, found.rows.T, strict=True)),
        dict(zip(names, found.nominal.tolist(), strict=True)),
        {each.name: each.unit for each in subject.metrics},
        found.arrived(),
    )


def sweep(
    spec: PathLike,
    out: PathLike,
    *,
    workers: int | None = None,
    law: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: Callable[[int], bool] = lambda done: False,
) -> pa.Table:
    """Compute the variants of a sweep file for any machine, as ``macromicro sweep`` does.

    Its worker processes import the script that calls it, which must do so under
    ``if __name__ == "__main__":``.

    Parameters
    ----------
    spec : PathLike
        The sweep's file; its ``job`` may be the settings file of a machine.
    out : PathLike
        Folder for the results.
    workers : int | None, optional
        Number of processes; default: one for each core.
    law : str | None, optional
        Control law, or "MODULE:LAW" of your own; default: that of the settings.
    resume, overwrite : bool, optional
        Continue the sweep in `out`; replace it.
    progress : Callable[[int], bool], optional
        Hears the number of finished variants; returns whether to stop. What is finished is kept,
        and `resume` continues.

    Returns
    -------
    pa.Table
        A row for each variant, as in ``results.parquet``: units are in the fields' metadata.

    Raises
    ------
    InputError
        An argument or the file is not accepted.
    InterruptedError
        `progress` has stopped it.
    """
    import pyarrow.parquet as pq

    from macromicro.report.provenance import software
    from macromicro.sweeps import results, run

    request = run.Request(
        Path(spec), Path(out), workers, resume=resume, overwrite=overwrite, law=law
    )
    ready = run.check(request)
    done = 0

    def begin(total: int, before: int) -> None:
        nonlocal done
        done = before

    def report(count: int, *_: object) -> None:
        nonlocal done
        done += count

    outcome = run.execute(ready, begin, report, lambda: progress(done), software())
    if outcome.summary is None:
        finished = f"{outcome.done} of {ready.spec.variants} variants are finished"
        raise InterruptedError(f"the sweep was stopped: {finished} in {ready.out}")
    return pq.read_table(ready.out / results.RESULTS)


def threads(workers: int | None, where: str) -> int:
    """The number of threads that a user asks for; None: one for each core."""
    return cores() if workers is None else keys.whole(workers, 1, MAX_WORKERS, where)


def _is_two_stage(what: PathLike | None) -> bool:
    return what is None or compositions.chosen(Path(os.fspath(what))).family == TURNS


def _bench(what: PathLike | None, law: str | None, settings: Any) -> Settings:
    """Settings of the two-stage machine under a law."""
    if settings is None:
        return bench_settings(Settings(), None if what is None else Path(os.fspath(what)), law)
    config.check(settings, "settings")
    own: Settings = bench_settings(settings, None, law)
    return own


def _machine(what: PathLike | None, law: str | None, settings: Any) -> tuple[AnyMachine, Any]:
    path = Path(os.fspath(cast("PathLike", what)))
    machine, own = compositions.load(path, law)
    if settings is None:
        return machine, own
    if law is not None:
        raise ProblemError("law", "the settings have a law of their own", "Choose it in them.")
    config.check(settings, "settings")
    return composite.under(machine, settings), settings
