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
LAWS = "each axis has a law of its own"
SET_LAWS = "Set x.law and y.law in the settings file."


class Joint(NamedTuple):
    name: str  # as a settings file names it
    title: str
    settings: Any
    # each axis as a machine of one stage, in the order of `settings.AXES`
    axes: tuple[Machine, Machine]
    spread: Path  # uncertainties beside those of each axis


_AXIS = machines.MACHINES[0]
_TABLE = Path(machines.__file__).parents[1] / "uncertainty" / f"{JOINT}.toml"
XY_MACHINE = Joint(JOINT, TITLE, DEFAULT, (_AXIS, _AXIS), _TABLE)


def is_joint(path: Path) -> bool:
    return read_toml(path, config.WHAT).get(KEY) == JOINT


def under(tree: XY) -> Joint:
    """The machine with the laws that settings choose."""
    first, second = (machines.under(_AXIS, each) for each in of(tree))
    return XY_MACHINE._replace(axes=(first, second))


def load(path: Path) -> tuple[Joint, Any]:
    settings = config.load_overrides(path, DEFAULT, JOINT)
    return under(settings), settings


def as_toml(settings: Any, only: str | None = None) -> str:
    body = config.as_toml(settings, only)
    return body if only is not None else f'{KEY} = "{JOINT}"\n{body}'


def alone(settings: Any, name: str) -> str:
    """One axis as a settings file of the machine `axis`, with its payload."""
    tree = of(settings)[AXES.index(name)]
    return machines.as_toml(machines.under(_AXIS, tree), tree)
