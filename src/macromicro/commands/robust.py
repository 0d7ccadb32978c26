"""``macromicro robust``: performance with parameters other than the nominal ones."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from macromicro.commands.group import announce_compiling, tell
from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.robustness.request import Ready
    from macromicro.robustness.study import Request

SAMPLES = 200


def robust(  # noqa: PLR0913, PLR0917 - a parameter for each option
    samples: int = SAMPLES,
    seed: int = 0,
    config: Path | None = None,
    programme: str | None = None,
    requirements: Path | None = None,
    law: str | None = None,
    fan: bool = False,
    variants: bool = False,
    workers: int | None = None,
    out: Path | None = None,
    overwrite: bool = False,
    figures: str = PNG,
    as_json: bool = False,
) -> None:
    """Try machines with other friction, load, noise and more.

    Of the two-stage machine, belt, room temperature and the actuator's age vary too. Of another
    machine (--config, docs/machines.md), what its data sheet leaves open varies.
    """
    from macromicro.drawing.files import formats
    from macromicro.machines import doubts
    from macromicro.robustness import files
    from macromicro.robustness.request import ready
    from macromicro.runs import folder
    from macromicro.runs.folder import locked

    kinds = formats(figures)
    found = ready(config, programme, law, workers, fan=fan, variants=variants)
    tell(found.setup.settings)
    for each in doubts.find_doubts(found.setup.settings):
        say(f"warning: {each.text}")
    request = found.request(samples, seed, requirements)
    place = folder.choose_folder(
        out, Path("results") / f"robust-{found.place}", overwrite=overwrite
    )
    folder.check(place, files.BYTES, overwrite=overwrite, names=files.FILES)
    with Signals() as signals, locked(place, overwrite=overwrite, names=files.FILES):
        _robust(request, found, (kinds, as_json), place, signals)


def _robust(
    request: Request, asked: Ready, how: tuple[tuple[str, ...], bool], out: Path, signals: Signals
) -> None:
    from macromicro.drawing.bar import progress
    from macromicro.report.provenance import software
    from macromicro.robustness import files, study, terminal
    from macromicro.robustness.words import About
    from macromicro.schema.config import difference

    kinds, as_json = how
    announce_compiling(asked.setup.is_compiled())
    asked.setup.compile()
    started, began = datetime.now().astimezone(), time.perf_counter()
    signals.later()
    with progress(asked.setup.title, "runs") as pace:

        def report(done: int, total: int) -> bool:
            pace.reach(done, total)
            return bool(signals.received) and done > 1  # the nominal machine and another

        found = study.run(request, asked.subject, report)
    overrides = difference(request.settings, asked.subject.default)
    about = About(
        asked.programme,
        asked.setup.title,
        asked.fan,
        started.isoformat(sep=" ", timespec="seconds"),
        time.perf_counter() - began,
        {key: text.strip('"') for key, text in overrides.items()},
        tuple(software()),
    )
    files.write(out, found, about, kinds)
    if as_json:
        print(files.as_json(found, about), end="")
    else:
        terminal.show(found, about, str(out))
        print(f"page: {out / files.PAGE}")
    if found.interrupted:
        _report_interruption(len(found.rows), request.samples, out)
        raise typer.Exit(signals.status)


def _report_interruption(done: int, asked: int, out: Path) -> None:
    say(
        f"interrupted after {done} of {asked} machines; "
        f"the results so far are in {out}, marked incomplete"
    )
