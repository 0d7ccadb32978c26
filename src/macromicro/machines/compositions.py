"""All machines of every family."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from macromicro.errors import ProblemError
from macromicro.machines import _two_stage, composite
from macromicro.machines import machine as machines
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.composition import ONE, STEP, TURNS, Composition
from macromicro.machines.guarding import Watch
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.machine import JOINT, KEY, Machine
from macromicro.machines.signals import Output, Sample
from macromicro.machines.tree import joined
from macromicro.recording import Recording
from macromicro.schema import config
from macromicro.schema.text import parsed_toml, printable, read_toml

UNNAMED = _two_stage.NAME  # of a settings file that names none


def of(machine: Machine) -> Composition:
    """A single-stage machine as a composition."""

    def load(path: Path, law: str | None = None) -> Any:
        return machines.load(path, law)[1]

    return Composition(
        name=machine.name,
        title=machine.title,
        family=ONE,
        stages=("macro",),
        settings=machine.settings,
        sample=Sample,
        outputs=Output,
        truth=machine.kind.truth,
        told=(machine.law.memory, Watch),
        load=load,
        as_toml=partial(machines.as_toml, machine),
    )


def machine(name: object, where: str) -> AnyMachine:
    """The machine of a name, or of a table of stages, as a settings file has it."""
    if isinstance(name, dict):
        return composite.from_table(name, where)
    return XY_MACHINE if name == JOINT else machines.named(name, where)


def load(path: Path, law: str | None = None) -> tuple[AnyMachine, Any]:
    """The machine that a settings file names, under the law that it chooses, and its settings."""
    whole = machine(_named(path), f"{printable(path, 300)}, {KEY}")
    if not isinstance(whole, Composite):
        return machines.load(path, law)
    settings = of_several(whole).load(path, law)
    return composite.under(whole, settings), settings


def with_settings(path: Path, law: str | None, settings: Any) -> tuple[AnyMachine, Any]:
    """The machine of a file, with other settings where they are given."""
    machine, own = load(path, law)
    if settings is None:
        return machine, own
    if law is not None:
        raise ProblemError("law", "the settings have a law of their own", "Choose it in them.")
    config.check(settings, "settings")
    return composite.under(machine, settings), settings


def is_two_stage(path: Path | None) -> bool:
    """Whether a settings file, or none, is for the two-stage machine."""
    return path is None or chosen(path).family == TURNS


def recorded(recording: Recording) -> tuple[AnyMachine, Any] | None:
    """The machine of a recording and its settings; None: the two-stage machine."""
    text, where = recording.attributes.get("settings"), "the recording's settings"
    table = parsed_toml(text, where) if isinstance(text, str) else {}
    name = table.pop(KEY, UNNAMED)
    if name == UNNAMED:
        return None
    whole = machine(name, where)
    settings = config.overridden(whole.settings, table, where)
    return composite.under(whole, settings), settings


def _named(path: Path) -> object:
    """What a settings file says of its machine."""
    return read_toml(path, config.WHAT).get(KEY, UNNAMED)


def of_several(whole: Composite) -> Composition:
    """A machine of several stages as a composition."""

    def load(path: Path, law: str | None = None) -> Any:
        composite.refuse_law(law, composite.names(whole))
        file, table = printable(path, 300), config.table(path)
        table.pop(KEY, None)
        with config.named_by_file(path):
            return config.overridden(whole.settings, table, file) if table else whole.settings

    first = whole.stages[0][1]
    return Composition(
        name=whole.name,
        title=whole.title,
        family=STEP,
        stages=composite.names(whole),
        settings=whole.settings,
        sample=Sample,
        outputs=Output,
        truth=first.kind.truth,
        told=(first.law.memory, Watch),
        load=load,
        as_toml=partial(machines.as_toml, whole),
    )


COMPOSITIONS: tuple[Composition, ...] = (
    _two_stage.COMPOSITION,
    of_several(XY_MACHINE),
    *(of(each) for each in machines.MACHINES),
)


def named(name: object, where: str) -> Composition:
    for each in COMPOSITIONS:
        if each.name == name:
            return each
    return of(machines.named(name, where))


def chosen(path: Path | None) -> Composition:
    """The machine that a settings file is for."""
    if path is None:
        return named(UNNAMED, KEY)
    name, where = _named(path), f"{printable(path, 300)}, {KEY}"
    if isinstance(name, dict):
        return of_several(composite.from_table(name, where))
    return named(name, where)


def each(path: Path) -> list[tuple[str, Machine, Any]]:
    """The stages of a machine: one, or several on one clock."""
    machine, settings = load(path)
    trees = machine.trees(settings)
    return [(name, one, tree) for (name, one), tree in zip(machine.stages, trees, strict=True)]


def by_default(composition: Composition, law: str | None) -> Any:
    if law is None:
        return composition.settings
    if composition.family == ONE:
        return joined(composition.settings, law, "--law")
    if composition.family == STEP:
        composite.refuse_law(law, composition.stages)
    return _two_stage.by_default(law)
