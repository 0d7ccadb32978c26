"""``tune`` and ``robust`` for the machines of one stage and of two axes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple

import typer

from macromicro.commands import machine_run
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
    """The machine that a file names."""
    from macromicro.machines.compositions import chosen

    return chosen(config).name


def tune(
    asked: Asked, stage: str, objective: str, evaluations: int, machines: tuple[int, int]
) -> None:
    """Look for better gains; `machines`: how many differ from the sheets, and fresh ones."""
    from macromicro.batch import cores
    from macromicro.drawing.bar import progress
    from macromicro.drawing.files import formats
    from macromicro.report.summary import as_json as to_json
    from macromicro.runs import folder
    from macromicro.schema import keys
    from macromicro.tuning import stage as tuning

    kinds = formats(asked.figures)
    pick = _tuned_pair if machine_run.in_step(asked.config) else _tuned_stage
    names, search, told = pick(asked)
    if stage not in names:
        raise InputError("stage", stage, f"{names[0]} for this machine")
    aim = tuning.named(objective)
    keys.seed(asked.seed, "--seed")
    keys.whole(evaluations, 10, 1_000_000, "--evaluations")
    folder.check(asked.out, 2_000_000, overwrite=asked.overwrite, names=told.FILES)
    with (
        Signals() as signals,
        folder.held(asked.out, overwrite=asked.overwrite, names=told.FILES),
        progress(f"{names[0]}, objective {aim.name}", "designs at most") as pace,
    ):
        pace.begin(evaluations)

        def tell(done: int, best: float) -> None:
            pace.reach(done, evaluations, f"least cost {best:.4g}")

        budget = tuning.Budget(evaluations, asked.seed, *machines, cores())
        found = search(aim, budget, tell)
        signals.later()
        told.write(asked.out, found, kinds)
    if asked.as_json:
        print(to_json(told.content(found)), end="")
        return
    print("\n".join(told.lines(found)))
    print(f"results: {asked.out}; try: macromicro run --config {asked.out / told.SETTINGS}")


def _tuned_stage(asked: Asked) -> tuple[tuple[str, ...], Any, Any]:
    """Names of what is tuned, its search and its files: of a machine of one stage."""
    from macromicro.machines import planning
    from macromicro.machines.machine import load
    from macromicro.tuning import stage, stage_files

    machine, settings = load(asked.config, asked.law)
    plan = planning.plan(planning.usual(settings), settings)

    def search(aim: Any, budget: Any, tell: Any) -> Any:
        aim = stage.named(aim.name, machine.kind.place)
        return stage.search(machine, settings, plan, aim, budget, tell)

    return (machine.kind.name, machine.name, "macro"), search, stage_files


def _tuned_pair(asked: Asked) -> tuple[tuple[str, ...], Any, Any]:
    """The same of a machine of two axes."""
    from functools import partial

    from macromicro.machines.joint import course, planning
    from macromicro.machines.joint.machine import load
    from macromicro.tuning import joint, joint_files

    only({"--law": asked.law}, name_of(asked.config))
    machine, settings = load(asked.config)
    plan = planning.plan(course.usual(settings), settings)
    return (machine.name,), partial(joint.search, machine, settings, plan), joint_files


def robust(
    asked: Asked, programme: str | None, samples: int, how: tuple[int | None, Path | None]
) -> None:
    """Try machines that differ from their sheets under the nominal law; `how`: threads, and a file
    of requirements."""
    from macromicro.batch import cores
    from macromicro.drawing.bar import progress
    from macromicro.drawing.files import formats
    from macromicro.report.summary import as_json as to_json
    from macromicro.robustness import stage_files as told
    from macromicro.runs import folder
    from macromicro.schema import keys

    kinds = formats(asked.figures)
    keys.seed(asked.seed, "--seed")
    workers, limits = how
    pick = _pair if machine_run.in_step(asked.config) else _stage
    title, required, study = pick(asked, programme, limits)
    folder.check(asked.out, 2_000_000, overwrite=asked.overwrite, names=told.FILES)
    with (
        Signals() as signals,
        folder.held(asked.out, overwrite=asked.overwrite, names=told.FILES),
    ):
        signals.later()
        with progress(title, "runs") as pace:
            pace.begin(samples + 1)

            def done(n: int) -> bool:
                pace.reach(n, samples + 1)
                return bool(signals.received)

            found = study(samples, asked.seed, workers or cores(), done)
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


def _stage(asked: Asked, programme: str | None, limits: Path | None) -> tuple[str, Any, Any]:
    """Title, requirements and study of a machine of one stage."""
    from functools import partial

    from macromicro import programme as programmes
    from macromicro.batch.stage_job import metrics
    from macromicro.machines import planning
    from macromicro.machines.machine import load
    from macromicro.robustness import requirements, stage

    machine, settings = load(asked.config, asked.law)
    required = () if limits is None else requirements.load(limits, metrics(machine.kind.place), ())
    if programme is None:
        moves = planning.usual(settings)
    else:
        moves = planning.load(programmes.find(programme), settings)
    plan = planning.plan(moves, settings)
    return moves.title, required, partial(stage.study, machine, settings, plan)


def _pair(asked: Asked, programme: str | None, limits: Path | None) -> tuple[str, Any, Any]:
    """The same of a machine of two axes."""
    from functools import partial

    from macromicro.machines.joint import job, planning
    from macromicro.machines.joint.machine import load
    from macromicro.robustness import joint, requirements

    only({"--law": asked.law}, name_of(asked.config))
    machine, settings = load(asked.config)
    required = joint.required(settings)
    if limits is not None:
        required = requirements.load(limits, joint.METRICS, required)
    moves = job.chosen(settings, programme)
    plan = planning.plan(moves, settings)
    return moves.title, required, partial(joint.study, machine, settings, plan)
