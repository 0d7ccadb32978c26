"""``macromicro collect EXPERIMENT``: laboratory procedures on a rig, saved as recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.commands._experiments import Experiment


def collect(  # noqa: PLR0913, PLR0917 - a parameter for each option
    experiment: str | None = None,
    rig: str = "twin",
    port: str | None = None,
    loop: str | None = None,
    calibration: Path | None = None,
    config: Path | None = None,
    seed: int = 0,
    out: Path | None = None,
    overwrite: bool = False,
    listed: bool = False,
) -> None:
    """Run a laboratory procedure and save its recordings.

    `identify` reads these files.
    """
    from macromicro.commands import _experiments
    from macromicro.rig.board.named import board_name
    from macromicro.runs import folder
    from macromicro.schema import keys

    if listed:
        print(*_experiments.list_experiments(config), sep="\n")
        return
    keys.seed(seed, "--seed")
    asked = _experiments.Asked(config, board_name(rig, port, loop, calibration), seed)
    found = _experiments.find(experiment or "", asked)
    place = folder.choose_folder(out, Path("results") / found.name, overwrite=overwrite)
    for one in found.each:
        folder.check(place / one.stage, one.size, overwrite=overwrite, names=())
    with Signals() as signals:
        for one in found.each:
            print(f"collecting {found.name} on {one.where}", file=sys.stderr)
            with folder.locked(place / one.stage, overwrite=overwrite, names=()):
                _collect(one, place / one.stage, signals)
            if found.then:
                print(f"then: {_experiments.following(found.then, place / one.stage)}")
    if signals.received:
        raise typer.Exit(signals.status)


def _collect(one: Experiment, place: Path, signals: Signals) -> None:
    from macromicro.runs import folder

    try:
        recordings = one.collect(signals)
    except KeyboardInterrupt:
        say("interrupted; nothing written")
        raise typer.Exit(signals.status or 130) from None
    with folder.staging(place) as stage:
        for name, recording in recordings.items():
            recording.save(stage / f"{name}.h5")
    for name, recording in recordings.items():
        count = int(recording["run"][-1]) if "run" in recording else 1
        runs = "1 run" if count == 1 else f"{count} runs"
        print(f"{place / name}.h5: {runs}, {len(recording)} rows of {recording.dt:g} s")
