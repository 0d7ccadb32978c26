"""``macromicro learn PROGRAMME``: iterative learning of a repeated trajectory."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.commands.group import tell
from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals
from macromicro.schema.text import write_text

if TYPE_CHECKING:
    from macromicro.lab.learning import Learned, Repetition
    from macromicro.recording import Recording
    from macromicro.runs.job import Job

_MOST = 1000
_SLOWEST = 0.1  # s


def learn(  # noqa: PLR0913, PLR0917 - one for each option
    programme: Path,
    repeats: int = 10,
    out: Path | None = None,
    config: Path | None = None,
    seed: int = 0,
    rig: str = "twin",
    law: str | None = None,
    lag: str | None = None,
    yes: bool = False,
    figures: str = PNG,
    overwrite: bool = False,
) -> None:
    """Repeat a trajectory and correct it after each run.

    The trajectory is one of the micro-stage; the Hall sensor measures it, in runs that begin
    cold. The folder then holds a figure and learned.csv, the same programme with a column of
    corrections for run and serve (docs/tuning.md).
    """
    from macromicro.commands import asking
    from macromicro.drawing.files import formats
    from macromicro.errors import InputError, ProblemError
    from macromicro.programme.scheduled import with_corrections
    from macromicro.report.learned import draw
    from macromicro.rig.replay import SCHEME
    from macromicro.runs import job as experiment
    from macromicro.runs.folder import choose_folder, locked
    from macromicro.schema.text import printable
    from macromicro.settings import Settings, choose
    from macromicro.units import quantity

    behind = None if lag is None else quantity(lag, "s", "--lag")
    if behind is not None and not 0.0 <= behind <= _SLOWEST:
        raise InputError("--lag", lag, f"0 s to {_SLOWEST:g} s")
    if not 2 <= repeats <= _MOST:
        raise InputError("--repeats", repeats, f"a whole number from 2 to {_MOST}")
    if programme.suffix != ".csv":
        remedy = "Give a programme by time (docs/running.md)."
        raise ProblemError(printable(programme), "not a CSV file", remedy)
    folder = choose_folder(out, Path("results") / "learn", overwrite=overwrite)
    kinds = formats(figures)
    request = experiment.Request(
        str(programme), folder, config, seed=seed, overwrite=overwrite, rig=rig, law=law
    )
    choose(Settings(), config, law)  # refuses other machines
    job = experiment.check(request)
    if rig.startswith(SCHEME):
        raise ProblemError(f"--rig {rig}", "learning needs a machine that moves, not a recording")
    asking.before(job, yes)
    with locked(folder, overwrite=overwrite), Signals() as signals:
        tell(job.settings)
        signals.later()
        found = _learn(job, repeats, behind, signals)
        text = with_corrections(programme, found.programme)
        write_text(folder / "learned.csv", text)
        draw(found, folder, kinds)
    before, after = found.repetitions[0], found.repetitions[found.best]
    print(f"RMS by the Hall sensor {1e6 * before.rms:.2f} um, learned {1e6 * after.rms:.2f} um")
    print(f"results: {folder}")
    print("next: " + following(folder, config, law, rig))


def following(folder: Path, config: Path | None, law: str | None, rig: str) -> str:
    """The command that runs the learned programme."""
    words = ["macromicro", "run", str(folder / "learned.csv")]
    given = (("--config", config), ("--law", law), ("--rig", rig if rig != "twin" else None))
    for option, value in given:
        words += [] if value is None else [option, str(value)]
    return shlex.join(words)


def _learn(job: Job, repeats: int, lag: float | None, signals: Signals) -> Learned:
    from macromicro.drawing.bar import progress
    from macromicro.lab import learning
    from macromicro.programme import Programme, travel
    from macromicro.runs import programmed

    s = job.settings
    limits = travel.limits(s.travel, s.sensors.encoder.pitch)

    def run(what: Programme, k: int) -> Recording:
        if signals.received:
            raise KeyboardInterrupt
        return programmed.record(what, s, on=job.source, seed=job.request.seed + k).recording

    lines = [f"{'run':>4} {'by Hall':>10} {'largest':>10} {'by laser':>10}"]
    with progress("learning", "runs") as pace:
        pace.begin(repeats)

        def told(k: int, found: Repetition) -> None:
            pace.add(1)
            lines.append(_line(k, found))

        behind = learning.sensor_lag(s) if lag is None else lag
        found = learning.learn(job.programme, run, behind, limits, repeats, told)
    print("\n".join(lines))
    return found


def _line(k: int, found: Repetition) -> str:
    by_laser = "-" if math.isnan(found.true) else f"{1e6 * found.true:7.2f} um"
    return f"{k + 1:>4} {1e6 * found.rms:7.2f} um {1e6 * found.peak:7.2f} um {by_laser:>10}"
