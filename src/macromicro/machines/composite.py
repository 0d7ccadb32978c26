"""A machine of several stages on one clock."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import InputError
from macromicro.machines import machine as machines
from macromicro.machines import stage_trees
from macromicro.machines.machine import Machine
from macromicro.machines.period import Bench, Extra, Stages
from macromicro.schema import config
from macromicro.schema.keys import found, unknown
from macromicro.schema.text import printable

TOGETHER = "together"  # the only order of stages: they begin each move at the same time
_NAME = re.compile("[a-z][a-z0-9]*")
_RESERVED = ("t", "true", "hold", "move", "phase", "arrived")  # they begin other columns and keys
_STAGES = 'two or more by name, such as { x = "axis", y = "axis", z = "piezo" }'
LAWS = "each axis has a law of its own"
SET_LAWS = "Set x.law and y.law in the settings file."


class Composite(NamedTuple):
    """Several stages that begin each move together."""

    name: str  # as a settings file names it
    title: str  # for people
    settings: Any  # a tree with the tree of each stage under its name
    stages: tuple[tuple[str, Machine], ...]  # by name
    spread: Path | None = None  # uncertainties beside those of each stage
    extra: Extra | None = None
    shared: Callable[[Any], Any] = lambda settings: ()  # parameters of `extra`
    written: str = ""  # how a settings file says which machine it is, where not by its name

    def trees(self, settings: Any) -> tuple[Any, ...]:
        """The settings of each stage."""
        return tuple(getattr(settings, name) for name, _ in self.stages)


AnyMachine = Machine | Composite


def described(raw: dict[str, Any], where: str) -> Composite:
    """The machine of a table ``{ stages = { x = "axis", z = "piezo" }, order = "together" }``."""
    unknown(raw, ("stages", "order"), f"{where}, ")
    order = raw.get("order", TOGETHER)
    if order != TOGETHER:
        raise InputError(f"{where}, order", printable(order), f'"{TOGETHER}"')
    kinds = raw.get("stages")
    if not isinstance(kinds, dict) or len(kinds) < 2:
        raise InputError(f"{where}, stages", found(kinds), _STAGES)
    stages = []
    for name, kind in kinds.items():
        if not _NAME.fullmatch(name) or name in _RESERVED:
            raise InputError(
                f"{where}, stages", printable(name), "a letter, then letters or digits"
            )
        stages.append((name, machines.named(kind, f"{where}, stages, {name}")))
    pairs = ", ".join(f'{name} = "{kind}"' for name, kind in kinds.items())
    title = f"{len(stages)} stages with coordinated moves"
    tree = stage_trees.made({name: one.settings for name, one in stages})
    written = f'{{ stages = {{ {pairs} }}, order = "{TOGETHER}" }}'
    return Composite("_".join(kinds), title, tree, tuple(stages), written=written)


def names(machine: AnyMachine) -> tuple[str, ...]:
    return tuple(name for name, _ in machine.stages)


def under(machine: AnyMachine, settings: Any) -> Any:
    """A machine with the laws that settings choose, and with the lines that they name."""
    if isinstance(machine, Machine):
        return machines.under(machine, settings)
    each = zip(machine.stages, machine.trees(settings), strict=True)
    stages = tuple((name, machines.under(one, tree)) for (name, one), tree in each)
    return machine._replace(stages=stages)


def clocked(machine: AnyMachine) -> Stages:
    """The stages as one control period takes them."""
    kinds = tuple(one.kind for _, one in machine.stages)
    laws = tuple(one.law for _, one in machine.stages)
    return Stages(kinds, laws, names(machine), getattr(machine, "extra", None))


def bench(machine: AnyMachine, settings: Any) -> Bench:
    """Runtime parameters of the simulated stages."""
    trees = machine.trees(settings)
    stages = tuple(
        one.kind.prepare(tree) for (_, one), tree in zip(machine.stages, trees, strict=True)
    )
    return Bench(stages, machine.shared(settings) if isinstance(machine, Composite) else ())


def period(machine: AnyMachine, settings: Any) -> float:
    """The control period, s."""
    return float(machine.trees(settings)[0].timing.period)


def as_toml(machine: AnyMachine, settings: Any, only: str | None = None) -> str:
    """All settings of a machine as TOML, headed by its name."""
    body = config.as_toml(settings, only)
    if only is not None:
        return body
    written = getattr(machine, "written", "") or f'"{machine.name}"'
    return f"{machines.KEY} = {written}\n{body}"
