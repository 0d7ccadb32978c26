"""The machine `xy` and its settings file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.machines import machine as machines
from macromicro.machines.joint.settings import AXES, DEFAULT, XY, of
from macromicro.machines.machine import JOINT, KEY, Machine
from macromicro.schema import config
from macromicro.schema.text import read_toml

TITLE = "two axes with coordinated motion"
LAWS = "nothing: each axis has its own, x.law and y.law"


class Joint(NamedTuple):
    """A machine of two axes.

    Attributes
    ----------
    name : str
        As a settings file names it.
    title : str
        For people.
    settings : Any
        Its default settings.
    axes : tuple[Machine, Machine]
        Each axis as a machine of one stage, in the order of `settings.AXES`.
    spread : Path
        What is not known beside what is not known about each axis.
    """

    name: str
    title: str
    settings: Any
    axes: tuple[Machine, Machine]
    spread: Path


_AXIS = machines.MACHINES[0]
_TABLE = Path(machines.__file__).parents[1] / "uncertainty" / f"{JOINT}.toml"
XY_MACHINE = Joint(JOINT, TITLE, DEFAULT, (_AXIS, _AXIS), _TABLE)


def is_joint(path: Path) -> bool:
    """Whether a settings file is for a machine of several axes.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    bool
        True if it names `xy`.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    return read_toml(path, config.WHAT).get(KEY) == JOINT


def under(tree: XY) -> Joint:
    """The machine under the laws that settings choose.

    Parameters
    ----------
    tree : XY
        Settings.

    Returns
    -------
    Joint
        The machine.
    """
    first, second = (machines.under(_AXIS, each) for each in of(tree))
    return XY_MACHINE._replace(axes=(first, second))


def load(path: Path) -> tuple[Joint, Any]:
    """The machine and its settings.

    Parameters
    ----------
    path : Path
        A settings file that names it.

    Returns
    -------
    machine : Joint
        Under the laws of its settings.
    settings : Any
        Its settings with the file's values, and what follows from them.

    Raises
    ------
    InputError
        As `config.load_overrides`.
    """
    settings = config.load_overrides(path, DEFAULT, JOINT)
    return under(settings), settings


def as_toml(settings: Any, only: str | None = None) -> str:
    """All settings as TOML, headed by the machine's name.

    Parameters
    ----------
    settings : Any
        Of the machine.
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
    return body if only is not None else f'{KEY} = "{JOINT}"\n{body}'


def alone(settings: Any, name: str) -> str:
    """One axis as a settings file of the machine `axis`, its payload included.

    Parameters
    ----------
    settings : Any
        Of the machine.
    name : str
        One of `AXES`.

    Returns
    -------
    str
        TOML that `machine.load` reads.
    """
    tree = of(settings)[AXES.index(name)]
    return machines.as_toml(machines.under(_AXIS, tree), tree)
