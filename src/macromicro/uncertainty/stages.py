"""The uncertain parameters of a machine of one stage, or of several on one clock."""

from __future__ import annotations

from typing import Any

from macromicro.errors import ProblemError
from macromicro.machines.composite import AnyMachine, with_trees
from macromicro.machines.joint.settings import NOTHING
from macromicro.machines.machine import Machine
from macromicro.machines.tree import OWN
from macromicro.schema.par import value_at
from macromicro.uncertainty.table import Uncertain, read_table

KEPT = ("controller", OWN, "guard", "motion", "arrival", "travel")


def uncertain(machine: AnyMachine, settings: Any) -> tuple[Uncertain, ...]:
    """Those of each stage, each drawn independently, and those of several."""
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
    shared = () if machine.spread is None else read_table(machine.spread, settings)
    return (*rows, *(row for row in shared if not (alone and row.name == "body")))


def _of_stage(machine: Machine, settings: Any) -> tuple[Uncertain, ...]:
    if machine.spread is None:
        raise ProblemError(
            "--config",
            f"the machine {machine.name} has no table of uncertain parameters (`spread`)",
        )
    rows = read_table(machine.spread, settings)
    return tuple(r for r in rows if any(value_at(settings, path) != 0.0 for path, _ in r.parts))


def keep_settings(machine: AnyMachine, settings: Any, drawn: Any) -> Any:
    """A drawn machine under the law, guard, motion and arrival of the settings."""
    pairs = zip(machine.trees(settings), machine.trees(drawn), strict=True)
    trees = [tree._replace(**{k: getattr(own, k) for k in KEPT}) for own, tree in pairs]
    return with_trees(machine, drawn, trees)
