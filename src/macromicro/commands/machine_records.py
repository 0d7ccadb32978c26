"""``collect`` for the machines of one stage."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import typer

from macromicro.commands.signals import Signals

_MOST = 40_000_000  # bytes of a recording


class Asked(NamedTuple):
    """What the command is given: settings, rig, seed, and where the recording goes."""

    config: Path
    rig: str
    seed: int
    out: Path | None
    overwrite: bool


def listed(config: Path) -> None:
    """Print the experiments of a machine."""
    from macromicro.commission import collecting
    from macromicro.machines.machine import load

    machine, _ = load(config)
    for one in collecting.PROCEDURES:
        if machine.name in one.machines:
            then = one.then.format(file=Path("results") / one.name / f"{one.name}.h5")
            print(f"{one.name:16}{one.gives}\n{'':16}then: {then}")


def collect(experiment: str | None, asked: Asked) -> None:
    """Run one and save its recording."""
    from macromicro.commission import collecting
    from macromicro.machines.machine import load
    from macromicro.rig.opening import TWIN, open_rig
    from macromicro.runs import folder
    from macromicro.schema import keys

    machine, tree = load(asked.config)
    procedure = collecting.find(experiment or "", machine)
    keys.seed(asked.seed, "--seed")
    rig = None
    if asked.rig != TWIN:
        fixture = open_rig(asked.rig, asked.seed)
        fixture.need(f"`macromicro collect {procedure.name}`", "encoder")
        rig = fixture.make(asked.seed)
    place = asked.out if asked.out is not None else Path("results") / procedure.name
    folder.check(place, _MOST, overwrite=asked.overwrite, names=())
    where = f"the simulated {machine.name}" if rig is None else asked.rig
    print(f"collecting {procedure.name} on {where}", file=sys.stderr)
    with Signals() as signals, folder.held(place, overwrite=asked.overwrite, names=()):
        signals.later()
        given = collecting.Given(machine, tree, rig, asked.seed)
        try:
            recording = procedure.collect(given, lambda: bool(signals.received))
        except KeyboardInterrupt:
            print("macromicro: interrupted; nothing written", file=sys.stderr)
            raise typer.Exit(signals.status or 130) from None
        with folder.staged(place) as stage:
            recording.save(stage / f"{procedure.name}.h5")
    file = place / f"{procedure.name}.h5"
    print(f"{file}: {len(recording)} rows of {recording.dt:g} s")
    print(f"then: {procedure.then.format(file=file)}")
    if signals.received:
        raise typer.Exit(signals.status)
