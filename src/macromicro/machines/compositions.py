"""All machines of every family."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from macromicro.errors import ProblemError
from macromicro.machines import _two_stage
from macromicro.machines import machine as machines
from macromicro.machines.composition import ONE, STEP, Composition
from macromicro.machines.guarding import Watch
from macromicro.machines.joint import machine as joint
from macromicro.machines.joint.settings import AXES, DEFAULT
from macromicro.machines.joint.settings import of as axes_of
from macromicro.machines.machine import JOINT, KEY, Machine
from macromicro.machines.signals import Output, Sample
from macromicro.machines.tree import joined
from macromicro.schema import config
from macromicro.schema.text import printable, read_toml

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


def _both(path: Path, law: str | None = None) -> Any:
    if law is not None:
        raise ProblemError("--law", joint.LAWS, joint.SET_LAWS)
    return joint.load(path)[1]


XY = Composition(
    name=JOINT,
    title=joint.TITLE,
    family=STEP,
    stages=AXES,
    settings=DEFAULT,
    sample=Sample,
    outputs=Output,
    truth=joint.XY_MACHINE.axes[0].kind.truth,
    told=(joint.XY_MACHINE.axes[0].law.memory, Watch),
    load=_both,
    as_toml=joint.as_toml,
)
COMPOSITIONS: tuple[Composition, ...] = (
    _two_stage.COMPOSITION,
    XY,
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
    name = read_toml(path, config.WHAT).get(KEY, UNNAMED)
    return named(name, f"{printable(path, 300)}, {KEY}")


def each(path: Path) -> list[tuple[str, Machine, Any]]:
    """The stages of a machine: one, or several on one clock."""
    if chosen(path).family != STEP:
        return [("", *machines.load(path))]
    both, settings = joint.load(path)
    return list(zip(AXES, both.axes, axes_of(settings), strict=True))


def by_default(composition: Composition, law: str | None) -> Any:
    if law is None:
        return composition.settings
    if composition.family == ONE:
        return joined(composition.settings, law, "--law")
    if composition.family == STEP:
        return _both(Path(), law)
    return _two_stage.by_default(law)
