"""``collect`` for the machines of one stage, and of axes on one clock."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.commission.collecting import Given, Procedure

_MOST = 40_000_000  # bytes of a recording


class Asked(NamedTuple):
    config: Path
    rig: str
    seed: int
    out: Path | None
    overwrite: bool


def listed(config: Path) -> None:
    from macromicro.commission import collecting
    from macromicro.machines.compositions import each

    stages = each(config)
    name, machine, _ = stages[0]
    for one in collecting.PROCEDURES:
        if machine.name in one.machines:
            file = Path("results") / one.name / name / f"{one.name}.h5"
            print(f"{one.name:16}{one.gives}\n{'':16}then: {one.then.format(file=file)}")
    if name:
        print(f"{'':16}of each axis: {', '.join(letter for letter, _, _ in stages)}")


def collect(experiment: str | None, asked: Asked) -> None:
    """Run one experiment on each stage and save its recording."""
    from macromicro.commission import collecting
    from macromicro.machines.compositions import each
    from macromicro.runs import folder
    from macromicro.schema import keys

    stages = each(asked.config)
    procedure = collecting.find(experiment or "", stages[0][1])
    keys.seed(asked.seed, "--seed")
    rigs = _named(asked.rig, tuple(name for name, _, _ in stages))
    place = folder.chosen(asked.out, Path("results") / procedure.name, overwrite=asked.overwrite)
    folders = [place / name for name, _, _ in stages]
    for one in folders:
        folder.check(one, _MOST, overwrite=asked.overwrite, names=())
    with Signals() as signals:
        signals.later()
        for one, (name, machine, tree), named in zip(folders, stages, rigs, strict=True):
            rig = _rig(named, tree, asked.seed)
            where = f"the simulated {machine.name}{f' {name}' if name else ''}"
            print(f"collecting {procedure.name} on {where if rig is None else named}",
                  file=sys.stderr)  # fmt: skip
            given = collecting.Given(machine, tree, rig, asked.seed)
            _saved(procedure, given, one, asked, signals)
    if signals.received:
        raise typer.Exit(signals.status)


def _named(rig: str, stages: tuple[str, ...]) -> list[str]:
    """The rig of each stage; several are driven one after the other."""
    from macromicro.machines import on_rig
    from macromicro.rig.opening import TWIN

    if stages == ("",) or rig == TWIN:
        return [rig] * len(stages)
    return on_rig.named(rig, stages)


def _rig(name: str, tree: Any, seed: int) -> Any:
    """The user's rig with the period of the settings; None for the simulated machine."""
    from macromicro.machines import on_rig
    from macromicro.rig.opening import TWIN

    return None if name == TWIN else on_rig.one(name, tree, seed).make(seed)


def _saved(procedure: Procedure, given: Given, place: Path, asked: Asked, signals: Signals) -> None:
    """Run one procedure on one stage and save its recording."""
    from macromicro.runs import folder

    with folder.held(place, overwrite=asked.overwrite, names=()):
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
