"""All machines: by name, in a settings file or in a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import ProblemError
from macromicro.machines import composite
from macromicro.machines import machine as machines
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.machine import JOINT, KEY, Machine
from macromicro.machines.tree import with_law
from macromicro.recording import Recording
from macromicro.schema import config
from macromicro.schema.text import parsed_toml, printable, read_toml
from macromicro.settings import Settings
from macromicro.settings import choose as two_stage_settings


class TwoStage(NamedTuple):
    """The thesis' machine, whose stages take turns; its files need not name it."""

    name: str = Settings().machine()
    title: str = (
        "a friction-ridden carriage for the way, a shape-memory stage on it for the last 4 mm"
    )
    settings: Settings = Settings()
    written: str = ""


TWO_STAGE = TwoStage()
MACHINES: tuple[AnyMachine | TwoStage, ...] = (TWO_STAGE, XY_MACHINE, *machines.MACHINES)


def machine(name: object, where: str) -> AnyMachine:
    """The machine of a name, or of a table of stages, as a settings file has it."""
    if isinstance(name, dict):
        return composite.from_table(name, where)
    return XY_MACHINE if name == JOINT else machines.named(name, where)


def by_name(name: object, where: str) -> AnyMachine | TwoStage:
    return TWO_STAGE if name == TWO_STAGE.name else machine(name, where)


def of_file(path: Path | None) -> AnyMachine | TwoStage:
    """The machine that a settings file, or none, is for."""
    if path is None:
        return TWO_STAGE
    return by_name(_machine_entry(path), f"{printable(path, 300)}, {KEY}")


def is_two_stage(path: Path | None) -> bool:
    """Whether a settings file, or none, is for the two-stage machine."""
    return isinstance(of_file(path), TwoStage)


def _machine_entry(path: Path) -> object:
    """What a settings file says of its machine."""
    return read_toml(path, config.WHAT).get(KEY, TWO_STAGE.name)


def load(path: Path, law: str | None = None) -> tuple[AnyMachine, Any]:
    """The machine that a settings file names, under the law that it chooses, and its settings."""
    whole = machine(_machine_entry(path), f"{printable(path, 300)}, {KEY}")
    if not isinstance(whole, Composite):
        return machines.load(path, law)
    composite.refuse_law(law, composite.names(whole))
    settings, table = whole.settings, config.table(path)
    table.pop(KEY, None)
    if table:
        with config.named_by_file(path):
            settings = config.overridden(settings, table, printable(path, 300))
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


def settings_of(path: Path, law: str | None = None) -> Any:
    """The settings in a file of any machine."""
    if is_two_stage(path):
        return two_stage_settings(Settings(), path, law)
    return load(path, law)[1]


def by_default(machine: AnyMachine | TwoStage, law: str | None) -> Any:
    """The settings of a machine without a file."""
    if isinstance(machine, TwoStage):
        return two_stage_settings(machine.settings, None, law)
    if law is None:
        return machine.settings
    if isinstance(machine, Composite):
        composite.refuse_law(law, composite.names(machine))
    return with_law(machine.settings, law, "--law")


def of_recording(recording: Recording) -> tuple[AnyMachine, Any] | None:
    """The machine of a recording and its settings; None: the two-stage machine."""
    text, where = recording.attributes.get("settings"), "the recording's settings"
    table = parsed_toml(text, where) if isinstance(text, str) else {}
    name = table.pop(KEY, TWO_STAGE.name)
    if name == TWO_STAGE.name:
        return None
    whole = machine(name, where)
    settings = config.overridden(whole.settings, table, where)
    return composite.under(whole, settings), settings


def each(path: Path) -> list[tuple[str, Machine, Any]]:
    """The stages of a machine: one, or several on one clock."""
    machine, settings = load(path)
    trees = machine.trees(settings)
    return [(name, one, tree) for (name, one), tree in zip(machine.stages, trees, strict=True)]
