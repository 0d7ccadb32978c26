"""``macromicro collect EXPERIMENT``: laboratory procedures on a rig, saved as recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from macromicro.commands.options import Calibration, Loop, Overwrite, Port, Rig, Seed, folder_option
from macromicro.commands.signals import Signals


def collect(  # noqa: PLR0913, PLR0917 - a parameter for each option
    experiment: Annotated[
        str | None,
        typer.Argument(
            help=(
                "An experiment that --list names, or MODULE:PROCEDURE of your "
                "own (docs/own-machines.md)."
            ),
            show_default=False,
        ),
    ] = None,
    rig: Rig = "twin",
    port: Port = None,
    loop: Loop = None,
    calibration: Calibration = None,
    config: Annotated[
        Path | None,
        typer.Option(
            help=(
                "Settings file; a machine of one stage has experiments of its "
                "own (docs/machines.md)."
            ),
            show_default=False,
        ),
    ] = None,
    seed: Seed = 0,
    out: Annotated[Path | None, folder_option("results/<experiment>", "the recordings")] = None,
    overwrite: Overwrite = False,
    listed: Annotated[bool, typer.Option("--list", help="List the experiments.")] = False,
) -> None:
    """Run a laboratory procedure and save its recordings.

    `identify` reads these files.
    """
    from macromicro.rig.board.named import joined
    from macromicro.rig.opening import TWIN, open_rig
    from macromicro.runs import folder
    from macromicro.runs.folder import held
    from macromicro.schema import keys
    from macromicro.schema.config import load_overrides
    from macromicro.settings import Settings
    from macromicro.thesis import collecting
    from macromicro.thesis.procedure import Lab

    rig = joined(rig, port, loop, calibration)
    from macromicro.commands import machine_run

    if config is not None and not machine_run.is_two_stage(config):
        from macromicro.commands import _machine_records

        asked = _machine_records.Asked(config, rig, seed, out, overwrite)
        _machine_records.listed(config) if listed else _machine_records.collect(experiment, asked)
        return
    if listed:
        for one in collecting.PROCEDURES:
            then = one.then.replace("{out}", str(Path("results") / one.name))
            print(f"{one.name:16}{one.gives}\n{'':16}needs: {one.needs}\n{'':16}then: {then}")
        return
    procedure = collecting.find(experiment or "")
    keys.seed(seed, "--seed")
    settings = Settings() if config is None else load_overrides(config, Settings())
    rigs = () if rig == TWIN else (open_rig(rig, seed, limits=settings.guard),)
    lab = Lab(settings, seed, rigs)
    lab.check(procedure)
    place = folder.chosen(out, Path("results") / procedure.name, overwrite=overwrite)
    folder.check(place, procedure.megabytes * 1_000_000, overwrite=overwrite, names=())
    where = "the twin" if rig == TWIN else rig
    print(f"collecting {procedure.name} on {where}", file=sys.stderr)
    with Signals() as signals, held(place, overwrite=overwrite, names=()):
        recordings = collecting.checked(procedure.collect(lab), procedure.name)
        signals.later()
        with folder.staged(place) as stage:
            for name, recording in recordings.items():
                recording.save(stage / f"{name}.h5")
    for name, recording in recordings.items():
        count = int(recording["run"][-1]) if "run" in recording else 1
        runs = "1 run" if count == 1 else f"{count} runs"
        print(f"{place / name}.h5: {runs}, {len(recording)} rows of {recording.dt:g} s")
    if procedure.then:
        print(f"then: {procedure.then.replace('{out}', str(place))}")
    if signals.received:
        raise typer.Exit(signals.status)
