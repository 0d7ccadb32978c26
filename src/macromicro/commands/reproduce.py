"""``macromicro reproduce``: the thesis' procedures on a rig, as a page, a table and JSON."""

from __future__ import annotations

import time
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from macromicro import portable
from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.thesis.procedure import Lab, Procedure
    from macromicro.thesis.reproduce import Chosen

MAX_JOBS = 256
OUT = Path("results/reproduction")
FOLDER_BYTES = 60_000_000


def reproduce(  # noqa: PLR0913, PLR0917 - a parameter for each option
    names: list[str] | None = None,
    only: list[str] | None = None,
    out: Path | None = None,
    as_json: bool = False,
    jobs: int | None = None,
    rig: list[str] | None = None,
    seed: int = 0,
    figures: str = PNG,
    overwrite: bool = False,
    listed: bool = False,
) -> None:
    """Measure every claim of the thesis and draw its figures.

    Differences from the thesis are listed with their reasons.
    """
    from macromicro.drawing.files import formats
    from macromicro.runs import folder
    from macromicro.runs.folder import locked
    from macromicro.thesis import all_procedures, choosing

    procedures = all_procedures()
    if listed:
        _list(procedures)
        return
    chosen = choosing.choose([*(only or []), *(names or [])], procedures)
    lab = _lab(rig or [], seed, chosen)._replace(figures=formats(figures))
    processes = _processes(jobs) if not lab.rigs else 1  # a rig is one thing
    out = folder.choose_folder(out, OUT, overwrite=overwrite)
    folder.check(out, FOLDER_BYTES, overwrite=overwrite, names=())
    with Signals() as signals, locked(out, overwrite=overwrite, names=()):
        _reproduce(chosen, lab, processes, out, as_json, signals)


def _processes(jobs: int | None) -> int:
    from macromicro.errors import InputError

    if jobs is None:
        return portable.cores()
    if not 1 <= jobs <= MAX_JOBS:
        raise InputError("--jobs", jobs, f"a whole number from 1 to {MAX_JOBS}")
    return jobs


def _lab(rigs: Sequence[str], seed: int, chosen: Sequence[Chosen]) -> Lab:
    from macromicro.rig.opening import TWIN, open_rig
    from macromicro.schema import keys
    from macromicro.thesis.procedure import Lab

    keys.seed(seed, "--seed")
    lab = Lab(seed=seed, rigs=tuple(open_rig(name, seed) for name in rigs if name != TWIN))
    for each in chosen:
        lab.check(each.procedure)
    return lab


def _reproduce(
    chosen: Sequence[Chosen], lab: Lab, jobs: int, out: Path, as_json: bool, signals: Signals
) -> None:
    from macromicro.thesis import all_procedures
    from macromicro.thesis import reproduce as experiment
    from macromicro.thesis.page import files, terminal
    from macromicro.thesis.page.reproduction import About

    started, began = datetime.now().astimezone(), time.perf_counter()
    signals.later()
    with terminal.progress([c.procedure for c in chosen]) as report:
        results = experiment.run(chosen, lab, jobs, report, lambda: bool(signals.received))
    about = About(
        started.isoformat(sep=" ", timespec="seconds"),
        time.perf_counter() - began,
        lab.seed,
        lab.settings,
        tuple(r.name for r in lab.rigs),
    )
    page = files.write(out, results, all_procedures(), about)
    if as_json:
        print(files.as_json(results), end="")
    else:
        terminal.show(results)
        print(f"page: {page}")
    failures = [r for r in results if r.failure]
    for result in failures:
        say(f"{result.name}: {result.failure}")
    noted = [(r.name, note) for r in results for note in r.notes]
    for name, note in noted:
        say(f"{name}: {note}")
    if signals.received or failures or noted:
        raise typer.Exit(signals.status or 1)


def _list(procedures: Sequence[Procedure]) -> None:
    for p in procedures:
        needs = ", ".join(p.channels) or "nothing, it is arithmetic"
        print(f"{p.name:22}{p.title} ({', '.join(p.sections)})")
        for what, values in (("claims", p.ids), ("figures", (*p.figures, *p.diagrams))):
            if values:
                print(f"{'':22}{what}: {', '.join(values)}")
        print(f"{'':22}needs: {needs}")
