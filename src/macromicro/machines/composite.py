"""A machine of several stages on one clock."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.machines import machine as machines
from macromicro.machines import stage_trees
from macromicro.machines.machine import Machine
from macromicro.machines.period import Bench, Extra, Stages
from macromicro.place import Place
from macromicro.schema.keys import show_value, unknown
from macromicro.schema.text import printable

# Orders of stages: they begin each move at the same time, or one after the other in their order in
# the table, each once the one before has arrived.
TOGETHER, IN_TURN = "together", "in turn"
_NAME = re.compile("[a-z][a-z0-9]*")
_RESERVED = ("t", "true", "hold", "move", "phase", "arrived")  # they begin other columns and keys
_STAGES = 'two or more by name, such as { x = "axis", y = "axis", z = "piezo" }'


class Composite(NamedTuple):
    """Several stages that move together or in turn."""

    name: str  # as a settings file names it
    title: str  # for people
    settings: Any  # a tree with the tree of each stage under its name
    stages: tuple[tuple[str, Machine], ...]  # by name
    spread: Path | None = None  # uncertainties beside those of each stage
    extra: Extra | None = None
    shared: Callable[[Any], Any] = lambda settings: ()  # parameters of `extra`
    description: str = ""  # of a settings file, as TOML, where the machine is not named
    order: str = TOGETHER  # or `IN_TURN`

    @property
    def written(self) -> str:
        """How a settings file names or describes it, as TOML."""
        return self.description or f'"{self.name}"'

    @property
    def has_plane(self) -> bool:
        """Whether two axes move along paths in a plane."""
        return self.extra is not None

    def trees(self, settings: Any) -> tuple[Any, ...]:
        """The settings of each stage."""
        return tuple(getattr(settings, name) for name, _ in self.stages)


AnyMachine = Machine | Composite


def from_table(raw: dict[str, Any], where: str) -> Composite:
    """The machine of a table ``{ stages = { x = "axis", z = "piezo" }, order = "together" }``."""
    unknown(raw, ("stages", "order"), f"{where}, ")
    order = raw.get("order", TOGETHER)
    if order not in (TOGETHER, IN_TURN):
        raise InputError(f"{where}, order", show_value(order), f'"{TOGETHER}" or "{IN_TURN}"')
    kinds = raw.get("stages")
    if not isinstance(kinds, dict) or len(kinds) < 2:
        raise InputError(f"{where}, stages", show_value(kinds), _STAGES)
    stages = []
    for name, kind in kinds.items():
        if not _NAME.fullmatch(name) or name in _RESERVED:
            raise InputError(
                f"{where}, stages", printable(name), "a letter, then letters or digits"
            )
        stages.append((name, machines.named(kind, f"{where}, stages, {name}")))
    pairs = ", ".join(f'{name} = "{kind}"' for name, kind in kinds.items())
    moves = "coordinated moves" if order == TOGETHER else "moves one after the other"
    title = f"{len(stages)} stages with {moves}"
    tree = stage_trees.joint_tree({name: one.settings for name, one in stages})
    description = f'{{ stages = {{ {pairs} }}, order = "{order}" }}'
    name = "_".join(kinds)
    return Composite(name, title, tree, tuple(stages), description=description, order=order)


def refuse_law(law: str | None, stages: Sequence[str]) -> None:
    """Refuse the option of one law for several stages."""
    if law is not None:
        laws = " and ".join(f"{name}.law" for name in stages)
        remedy = f"Set {laws} in the settings file."
        raise ProblemError("--law", "each axis has a law of its own", remedy)


def names(machine: AnyMachine) -> tuple[str, ...]:
    return tuple(name for name, _ in machine.stages)


def places(machine: AnyMachine) -> tuple[Place, ...]:
    """The units of the stages."""
    return tuple(one.kind.place for _, one in machine.stages)


def under(machine: AnyMachine, settings: Any) -> Any:
    """A machine with the laws that settings choose, and with the lines that they name."""
    if isinstance(machine, Machine):
        return machines.under(machine, settings)
    each = zip(machine.stages, machine.trees(settings), strict=True)
    stages = tuple((name, machines.under(one, tree)) for (name, one), tree in each)
    return machine._replace(stages=stages)


def with_trees(machine: AnyMachine, settings: Any, trees: Sequence[Any]) -> Any:
    """The settings of a machine with others of each stage."""
    if isinstance(machine, Machine):
        return trees[0]
    return settings._replace(**dict(zip(names(machine), trees, strict=True)))


def stages(machine: AnyMachine) -> Stages:
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
