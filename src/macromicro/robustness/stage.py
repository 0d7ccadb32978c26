"""Robustness of a machine under its nominal law, motion and guard.

Each stage of several is drawn independently.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.batch import Metric
from macromicro.batch.stage_job import metrics
from macromicro.batch.variants import CODE, FAULT
from macromicro.errors import ProblemError
from macromicro.machines.composite import AnyMachine, Composite, names
from macromicro.machines.joint.settings import NOTHING
from macromicro.machines.machine import Machine, as_toml
from macromicro.machines.planning import Planned
from macromicro.machines.tree import OWN
from macromicro.machines.trial import trials
from macromicro.robustness.requirements import NO_FAULT, Requirement
from macromicro.robustness.study import Subject
from macromicro.schema.par import value_at
from macromicro.uncertainty.table import Uncertain, read

MOST_DRAWN = 6  # metrics
KEPT = ("controller", OWN, "guard", "motion", "arrival", "travel")


def uncertain(machine: AnyMachine, settings: Any) -> tuple[Uncertain, ...]:
    """The uncertain parameters that a machine has: of each stage, and those of several."""
    if isinstance(machine, Machine):
        return _of_stage(machine, settings)
    rows: list[Uncertain] = []
    for (name, one), tree in zip(machine.stages, machine.trees(settings), strict=True):
        for row in _of_stage(one, tree):
            parts = tuple((f"{name}.{path}", weight) for path, weight in row.parts)
            meaning = f"{name}: {row.meaning}"
            rows.append(row._replace(name=f"{name}_{row.name}", parts=parts, meaning=meaning))
    stack = getattr(settings, "stack", None)
    alone = stack is not None and stack.carries == NOTHING
    shared = () if machine.spread is None else read(machine.spread, settings)
    return (*rows, *(row for row in shared if not (alone and row.name == "body")))


def _of_stage(machine: Machine, settings: Any) -> tuple[Uncertain, ...]:
    if machine.spread is None:
        raise ProblemError(
            "--config",
            f"the machine {machine.name} has no table of uncertain parameters (`spread`)",
        )
    rows = read(machine.spread, settings)
    return tuple(r for r in rows if any(value_at(settings, path) != 0.0 for path, _ in r.parts))


def kept(machine: AnyMachine, settings: Any, drawn: Any) -> Any:
    """A drawn machine under the law, guard, motion and arrival of the settings."""
    pairs = zip(machine.trees(settings), machine.trees(drawn), strict=True)
    trees = [tree._replace(**{k: getattr(own, k) for k in KEPT}) for own, tree in pairs]
    if isinstance(machine, Machine):
        return trees[0]
    return drawn._replace(**dict(zip(names(machine), trees, strict=True)))


def required(machine: AnyMachine, settings: Any) -> tuple[Requirement, ...]:
    """Default requirements: every move arrives, and within the tolerance of a path in a plane."""
    known = {each.name: each for each in _metrics(machine)}
    found = [
        Requirement(FAULT, 0.0, NO_FAULT),
        Requirement(known["missed"], 0.0, "every move must arrive"),
    ]
    if isinstance(machine, Composite) and machine.has_plane:
        limit = 1e6 * settings.path.tolerance
        found.append(Requirement(known["contour"], limit, "path.tolerance"))
    return tuple(found)


def subject(machine: AnyMachine, settings: Any, plan: Planned, workers: int) -> Subject:
    """A machine of one stage, or of several on one clock, with a plan, run in threads."""
    found = _metrics(machine)

    def evaluate(trees: Sequence[Any], seeds: Sequence[int], done: Callable[[int], bool]) -> Array:
        rows = np.array(trials(machine, trees, plan, seeds, workers, done), dtype=float)
        rows = rows.reshape(-1, len(found) - 1)
        return np.column_stack([rows[:, 0] != 0.0, rows[:, 1:], rows[:, 0]])

    return Subject(
        machine.name,
        found,
        _main([each.name for each in found[2:-1]]),
        evaluate,
        uncertain(machine, settings),
        required(machine, settings),
        machine.settings,
        partial(as_toml, machine),
        lambda tree: kept(machine, settings, tree),
    )


def _metrics(machine: AnyMachine) -> tuple[Metric, ...]:
    """The figures of a run, with the fault apart from its code."""
    return (FAULT, *metrics(machine)[1:], CODE)


def _main(names: Sequence[str]) -> tuple[str, ...]:
    """Those that are drawn: errors on the way and at rest before all others."""
    last = ("mean_settling", "effort", "rough")
    return tuple(sorted(names, key=lambda name: name.startswith(last))[:MOST_DRAWN])
