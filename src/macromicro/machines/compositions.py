"""All machines of every family."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from macromicro.errors import ProblemError
from macromicro.machines import _two_stage, composite
from macromicro.machines import machine as machines
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.composition import ONE, STEP, Composition
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

    def as_toml(settings: Any, only: str | None = None) -> str:
        return machines.as_toml(machine, settings, only)

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
        as_toml=as_toml,
    )


def machine(name: object, where: str) -> AnyMachine:
    """The machine of a name, of one stage or of several on one clock."""
    return XY_MACHINE if name == JOINT else machines.named(name, where)


def load(path: Path, law: str | None = None) -> tuple[AnyMachine, Any]:
    """The machine that a settings file names, under the law that it chooses, and its settings."""
    made = chosen(path)
    if made.family == ONE:
        return machines.load(path, law)
    if made.family != STEP:
        return machines.named(made.name, KEY), made.settings  # refused, with those that there are
    settings = made.load(path, law)
    whole = _table(read_toml(path, config.WHAT), path)
    return composite.under(whole, settings), settings


def recorded(recording: Recording) -> tuple[AnyMachine, Any] | None:
    """The machine of a recording and its settings; None: the two-stage machine."""
    text = recording.attributes.get("settings")
    table = parsed_toml(text, "the recording's settings") if isinstance(text, str) else {}
    name = table.pop(KEY, UNNAMED)
    if name == UNNAMED:
        return None
    where = "the recording's settings"
    whole = composite.described(name, where) if isinstance(name, dict) else machine(name, where)
    settings = config.overridden(whole.settings, table, where)
    return composite.under(whole, settings), settings


def _table(table: Mapping[str, Any], path: Path) -> Composite:
    """The machine of several stages that a file names or describes."""
    raw = table.get(KEY)
    if isinstance(raw, dict):
        return composite.described(raw, f"{printable(path, 300)}, {KEY}")
    return XY_MACHINE


def several(whole: Composite) -> Composition:
    """A machine of several stages as a composition."""

    def load(path: Path, law: str | None = None) -> Any:
        if law is not None:
            raise ProblemError("--law", composite.LAWS, composite.SET_LAWS)
        file, table = printable(path, 300), read_toml(path, config.WHAT)
        table.pop(KEY, None)
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
        as_toml=partial(composite.as_toml, whole),
    )


COMPOSITIONS: tuple[Composition, ...] = (
    _two_stage.COMPOSITION,
    several(XY_MACHINE),
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
    table = read_toml(path, config.WHAT)
    name = table.get(KEY, UNNAMED)
    if isinstance(name, dict):
        return several(_table(table, path))
    return named(name, f"{printable(path, 300)}, {KEY}")


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
        raise ProblemError("--law", composite.LAWS, composite.SET_LAWS)
    return _two_stage.by_default(law)
