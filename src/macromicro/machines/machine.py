"""The machines there are: each a file that composes parts, and a line in `MACHINES`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.control.stage_law import StageLaw
from macromicro.errors import InputError
from macromicro.machines import axis, piezo, sheets, wire
from macromicro.machines.stage import Kind
from macromicro.schema import config
from macromicro.schema.keys import nearest
from macromicro.schema.text import printable, read_toml

TWO_STAGE = "two_stage"  # the thesis' machine, whose settings are `settings.Settings`
KEY = config.MACHINE


class Machine(NamedTuple):
    """A machine of one stage.

    Attributes
    ----------
    name : str
        As a settings file names it.
    title : str
        For people.
    settings : Any
        Its default settings: a tree with `derived`, `together` and `machine`, and the sets
        encoder (with pitch), timing (with period), travel, motion, arrival, controller and guard.
    kind : Kind
        The kernels of its stage.
    law : StageLaw
        Whose gains are the set `controller`.
    model : Callable[[Any, Array], Any] | None
        From settings and frequencies (Hz) to the linear plant there, complex, m/V; None: there is
        none, and no `response`.
    """

    name: str
    title: str
    settings: Any
    kind: Kind
    law: StageLaw
    model: Callable[[Any, Array], Any] | None = None


MACHINES: tuple[Machine, ...] = (
    Machine(axis.NAME, axis.TITLE, axis.DEFAULT, axis.KIND, axis.LAW, sheets.plant),
    Machine(piezo.NAME, piezo.TITLE, piezo.DEFAULT, piezo.KIND, piezo.LAW),
    Machine(wire.NAME, wire.TITLE, wire.DEFAULT, wire.KIND, wire.LAW),
)
NAMES = (TWO_STAGE, *(m.name for m in MACHINES))


def named(name: object, where: str) -> Machine | None:
    """The machine of a name.

    Parameters
    ----------
    name : object
        As written.
    where : str
        File and key, or option, for the message.

    Returns
    -------
    Machine | None
        None for the two-stage machine.

    Raises
    ------
    InputError
        There is none; names the nearest and all.
    """
    if name == TWO_STAGE:
        return None
    for machine in MACHINES:
        if machine.name == name:
            return machine
    near = nearest(str(name), NAMES) if len(NAMES) > 12 else f"one of {', '.join(NAMES)}"
    raise InputError(where, printable(name), near)


def chosen(path: Path) -> Machine | None:
    """The machine that a settings file names.

    Parameters
    ----------
    path : Path
        The file; only its key `machine` is looked at.

    Returns
    -------
    Machine | None
        None for the two-stage machine, and for a file that names none.

    Raises
    ------
    InputError
        The file cannot be read, or names no machine there is.
    """
    path = Path(path)
    name = read_toml(path, config.WHAT).get(KEY, TWO_STAGE)
    return named(name, f"{printable(path, 300)}, {KEY}")


def load(path: Path) -> tuple[Machine, Any]:
    """A machine and its settings.

    Parameters
    ----------
    path : Path
        A settings file that names a machine of one stage.

    Returns
    -------
    machine : Machine
        The machine.
    settings : Any
        Its settings with the file's values, and what follows from them.

    Raises
    ------
    InputError
        As `chosen` and `config.load_overrides`; or the file is for the two-stage machine.
    """
    path = Path(path)
    machine = chosen(path)
    if machine is None:
        others = ", ".join(repr(m.name) for m in MACHINES)
        raise InputError(f"{printable(path, 300)}, {KEY}", TWO_STAGE, f"one of {others} here")
    return machine, config.load_overrides(path, machine.settings)


def as_toml(settings: Any, only: str | None = None) -> str:
    """All settings of a machine as TOML, headed by its name.

    Parameters
    ----------
    settings : Any
        A tree with a method `machine`.
    only : str | None, optional
        One set or one parameter; None for all.

    Returns
    -------
    str
        TOML that `load` reads back.

    Raises
    ------
    InputError
        `only` is no path of the tree.
    """
    body = config.as_toml(settings, only)
    return body if only is not None else f'{KEY} = "{settings.machine()}"\n\n{body}'
