"""The machine `xy`: two axes with coordinated motion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from macromicro.columns import Quantity
from macromicro.kernel import kernel
from macromicro.machines import machine as machines
from macromicro.machines.composite import Composite
from macromicro.machines.joint.settings import AXES, DEFAULT
from macromicro.machines.machine import JOINT
from macromicro.machines.period import Extra

TITLE = "two axes with coordinated motion"
_AXIS = machines.MACHINES[0]
_TABLE = Path(machines.__file__).parents[1] / "uncertainty" / f"{JOINT}.toml"


class Place(NamedTuple):
    """The true position of the load in the plane."""

    x: Annotated[float, Quantity("mm", "true place in the plane", column="true_x", scale=1e3)]
    y: Annotated[float, Quantity("mm", "true place in the plane", column="true_y", scale=1e3)]


class Plane(NamedTuple):
    """Orientation of the second axis against the first."""

    along: float  # travel along x for a travel of the second axis, m/m
    across: float


def plane(settings: Any) -> Plane:
    slant = settings.hidden.squareness
    return Plane(-math.sin(slant), math.cos(slant))


@kernel
def placed(plane: Plane, first: float, second: float) -> Place:
    return Place(first + plane.along * second, plane.across * second)


@kernel
def _shown(plane: Plane, truths: Any) -> Place:
    return placed(plane, truths[0][0], truths[1][0])


XY_MACHINE = Composite(
    JOINT,
    TITLE,
    DEFAULT,
    tuple((name, _AXIS) for name in AXES),
    _TABLE,
    Extra(Place, _shown),
    plane,
)
