"""Studies of many runs from Python, for any machine: calibrate, tune, robust, sweep."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.api import PathLike
from macromicro.arrays import Array
from macromicro.calibration import procedure
from macromicro.calibration import request as calibration_request
from macromicro.calibration.procedure import Calibration
from macromicro.errors import naming_arguments
from macromicro.robustness import request as robust_request
from macromicro.robustness import study
from macromicro.robustness.statistics import Share
from macromicro.tuning.request import Request, ready
from macromicro.tuning.search import Tuning

if TYPE_CHECKING:
    import pyarrow as pa


Progress = Callable[[int, float], None]


class Tuned(NamedTuple):
    """Result of `tune`."""

    settings: Any  #: with the gains found; the given ones where none were better
    better: bool  #: whether the cost is lower than before
    #: before, after: figures of the machine's run by name, under the given gains and these
    before: dict[str, float]
    after: dict[str, float]
    evaluations: int  #: designs that were tried
    costs: tuple[float, float]  #: the objective with its penalties, before and after
    search: Tuning  #: the search itself

    def margins(self) -> tuple[dict[str, float], dict[str, float]]:
        """Margins before and after.

        Returns
        -------
        tuple[dict[str, float], dict[str, float]]
            By name, with the linear model; of the micro-stage a measured ripple margin; empty
            where there are none.
        """
        versions = (self.search.first, self.search.best)
        subject = self.search.subject
        each = ({m.name: m.value for m in subject.margins(v.settings)} for v in versions)
        before, after = each
        return before, after


class Robustness(NamedTuple):
    """Result of `robust`: a row for each machine that was drawn."""

    #: what was varied, by name: a value for each machine, as in the table of uncertain parameters
    parameters: dict[str, Array]
    #: figures of the runs by name: infinity where a machine never settles, NaN where it is unknown
    figures: dict[str, Array]
    nominal: dict[str, float]  #: the same figures of the settings themselves
    units: dict[str, str]  #: of the figures
    arrived: Share  #: machines on which all moves arrive, with the bounds of the true share


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
        Number of machines to search on, the nominal one among them; what was found is then judged
        on fresh ones. 0: on the nominal one alone.
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
    request = Request(
        _path(what), stage, objective, law, evaluations, seed,
        benches > 0, benches or None, settings=settings,
    )  # fmt: skip
    with naming_arguments():
        search = ready(request)
    found = search.search(progress)
    before, after = (dict(version.runs[0]) for version in (found.first, found.best))
    return Tuned(
        found.best.settings, found.better, before, after, found.evaluations, found.verdict, found
    )


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
    with naming_arguments():
        chosen = robust_request.ready(_path(what), programme, law, workers, settings=settings)
        request = chosen.request(samples, seed, None)._replace(single=False)
    subject = chosen.subject
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
    with naming_arguments():
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


def _path(what: PathLike | None) -> Path | None:
    return None if what is None else Path(os.fspath(what))


def calibrate(
    what: PathLike,
    *,
    reference: str = "",
    positions: int = 40,
    runs: int = 5,
    cogging: bool = False,
    reversals: bool = False,
    seed: int = 0,
    settings: Any = None,
) -> Calibration:
    """Measure a machine's errors along its travel and correct them, and write no file.

    Parameters
    ----------
    what : PathLike
        Settings file of the machine.
    reference : str, optional
        Simulated instrument: "laser", "scale", "camera", "capacitive", "dial", or
        "autocollimator" for angles; default: "laser" or "autocollimator".
    positions : int, optional
        Positions along each axis.
    runs : int, optional
        Runs in both directions.
    cogging : bool, optional
        Whether efforts along the travel are learned as well, by slow passes.
    reversals : bool, optional
        Whether efforts where a plane's motions turn back are learned as well, by circles.
    seed : int, optional
        Seed of positions and noise.
    settings : Any, optional
        Settings of the machine; default: those of its file.

    Returns
    -------
    Calibration
        `settings` with the corrections, and for each stage what was found and the figures of
        ISO 230-2 before and after (`axes`), in m or rad.

    Raises
    ------
    InputError
        An argument or the settings are not accepted.
    """
    asked = (_path(what), reference, positions, runs, (), seed)
    with naming_arguments():
        request = calibration_request.ready(*asked, cogging=cogging, reversals=reversals)
    return procedure.calibrate(request if settings is None else request._replace(settings=settings))
