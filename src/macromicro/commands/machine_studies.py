"""``tune`` and ``robust`` for the machines of one stage."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import typer

from macromicro.commands.signals import Signals
from macromicro.errors import InputError

OTHERS, FRESH = 8, 50  # machines of a robust search, and to judge it by


class Asked(NamedTuple):
    """What both commands are given: settings, law, the results' folder, how they are told."""

    config: Path
    law: str | None
    out: Path
    overwrite: bool
    figures: str
    as_json: bool
    seed: int


def only(given: dict[str, object], name: str) -> None:
    """InputError for an option that means nothing for a machine of one stage."""
    for option, value in given.items():
        if value:
            raise InputError(option, str(value), f"nothing: the machine {name} has no such choice")


def name_of(config: Path) -> str:
    """The machine that a file names, which is one of one stage."""
    from macromicro.machines.machine import chosen

    machine = chosen(config)
    assert machine is not None  # the two-stage machine has commands of its own
    return machine.name


def tune(
    asked: Asked, stage: str, objective: str, evaluations: int, machines: tuple[int, int]
) -> None:
    """Look for better gains; `machines`: how many differ from the sheets, and fresh ones."""
    from macromicro.batch import cores
    from macromicro.drawing.bar import progress
    from macromicro.drawing.files import formats
    from macromicro.machines import planning
    from macromicro.machines.machine import load
    from macromicro.report.summary import as_json as to_json
    from macromicro.runs import folder
    from macromicro.schema import keys
    from macromicro.tuning import stage as tuning
    from macromicro.tuning import stage_files as told

    kinds = formats(asked.figures)
    machine, settings = load(asked.config, asked.law)
    if stage not in (machine.kind.name, machine.name, "macro"):
        raise InputError("stage", stage, f"{machine.kind.name} for this machine")
    aim = tuning.named(objective, machine.kind.place)
    keys.seed(asked.seed, "--seed")
    keys.whole(evaluations, 10, 1_000_000, "--evaluations")
    plan = planning.plan(planning.usual(settings), settings)
    folder.check(asked.out, 2_000_000, overwrite=asked.overwrite, names=told.FILES)
    with (
        Signals() as signals,
        folder.held(asked.out, overwrite=asked.overwrite, names=told.FILES),
        progress(f"{machine.kind.name}, objective {aim.name}", "designs at most") as pace,
    ):
        pace.begin(evaluations)

        def tell(done: int, best: float) -> None:
            pace.reach(done, evaluations, f"least cost {best:.4g}")

        found = tuning.search(
            machine,
            settings,
            plan,
            aim,
            tuning.Budget(evaluations, asked.seed, *machines, cores()),
            tell,
        )
        signals.later()
        told.write(asked.out, found, kinds)
    if asked.as_json:
        print(to_json(told.content(found)), end="")
        return
    for name, before, after, unit in told.table(found):
        print(f"{name:66} {before:12.5g} {after:12.5g} {unit}".rstrip())
    print(f"results: {asked.out}; try: macromicro run --config {asked.out / told.SETTINGS}")


def robust(
    asked: Asked, programme: str | None, samples: int, how: tuple[int | None, Path | None]
) -> None:
    """Try machines that differ from their sheets under the nominal law; `how`: threads, and a file
    of requirements."""
    from macromicro import programme as programmes
    from macromicro.batch import cores
    from macromicro.batch.stage_job import metrics
    from macromicro.drawing.bar import progress
    from macromicro.drawing.files import formats
    from macromicro.machines import planning
    from macromicro.machines.machine import load
    from macromicro.report.summary import as_json as to_json
    from macromicro.robustness import requirements
    from macromicro.robustness import stage as robustness
    from macromicro.robustness import stage_files as told
    from macromicro.runs import folder
    from macromicro.schema import keys

    kinds = formats(asked.figures)
    machine, settings = load(asked.config, asked.law)
    keys.seed(asked.seed, "--seed")
    workers, limits = how
    required = () if limits is None else requirements.load(limits, metrics(machine.kind.place), ())
    if programme is None:
        moves = planning.usual(settings)
    else:
        moves = planning.load(programmes.find(programme), settings)
    plan = planning.plan(moves, settings)
    folder.check(asked.out, 2_000_000, overwrite=asked.overwrite, names=told.FILES)
    with (
        Signals() as signals,
        folder.held(asked.out, overwrite=asked.overwrite, names=told.FILES),
    ):
        signals.later()
        with progress(moves.title, "runs") as pace:
            pace.begin(samples + 1)

            def done(n: int) -> bool:
                pace.reach(n, samples + 1)
                return bool(signals.received)

            found = robustness.study(
                machine, settings, plan, samples, asked.seed, workers or cores(), done
            )
        if not found.found:
            print("macromicro: interrupted; nothing written", file=sys.stderr)
            raise typer.Exit(signals.status)
        found = found._replace(required=required)
        told.write(asked.out, found, kinds)
    if asked.as_json:
        print(to_json(told.content(found)), end="")
    else:
        print("\n".join(told.lines(found)))
        print(f"results: {asked.out}")
    if len(found.found) < samples:
        said = f"interrupted after {len(found.found)} of {samples} machines"
        print(f"macromicro: {said}", file=sys.stderr)
        raise typer.Exit(signals.status or 1)
