"""Settings of the machine `xy`: two axes, their stacking, the path."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from macromicro.machines import axis, stage_trees
from macromicro.machines._rounding import round_to
from macromicro.machines.tree import Checked, Problem, Rule, derive_all, with_
from macromicro.schema.par import Given, Par

AXES = ("x", "y")
UPPER, NOTHING = "y", "nothing"
_DERIVED = "derived from the data sheets"


class Stack(NamedTuple):
    """How the axes stand on one another."""

    carries: Annotated[
        str,
        Par(
            "",
            "what the axis x carries: the whole axis y, or nothing where they stand side by side",
            "drawing",
            choices=(UPPER, NOTHING),
        ),
    ] = UPPER
    body: Annotated[
        float,
        Par(
            "kg",
            "mass of the axis y that does not move along y: rail, screw, motor",
            "data sheet or drawing",
            lo=0.0,
        ),
    ] = 1.0


class Along(NamedTuple):
    speed: Annotated[float, Par("m/s", "greatest speed in the plane", _DERIVED, positive=True)] = (
        1.0
    )
    acceleration: Annotated[
        float, Par("m/s^2", "greatest acceleration in the plane", _DERIVED, positive=True)
    ] = 10.0
    tolerance: Annotated[
        float, Par("m", "contour error that is accepted", _DERIVED, shown="um", positive=True)
    ] = 50.0e-6


class Hidden(NamedTuple):
    """Properties of the bench that no law or data sheet knows."""

    squareness: Annotated[
        float,
        Par(
            "rad",
            "angle from x to y, less 90 deg",
            "bench assumption",
            shown="deg",
            lo=-0.1,
            hi=0.1,
        ),
    ] = 0.0


class XY(NamedTuple):
    """Settings of ``machine = "xy"``; `DEFAULT` has derived values filled in."""

    stack: Stack = Stack()
    path: Along = Along()
    hidden: Hidden = Hidden()
    x: Any = axis.Axis()
    y: Any = axis.Axis()
    given: Given = Given()

    def derived(self) -> tuple[Rule, ...]:
        return RULES

    def together(self) -> list[Problem]:
        """Conflicts beyond those of each axis."""
        return [(path, value, words) for wrong, path, value, words in _checks(self) if wrong]

    def grown(self, table: Mapping[str, object], where: str) -> XY:
        """With the gains and parts that a table names."""
        made: XY = stage_trees.with_gains(self, AXES, table, where)
        return made

    def with_(self, changes: str | Mapping[str, object], value: object = None) -> XY:
        """With other values and what follows from them."""
        return with_(self, changes, value)


def of(tree: XY) -> tuple[Any, Any]:
    return tree.x, tree.y


def _carried_mass(tree: XY) -> float:
    """Mass of y that x carries."""
    if tree.stack.carries == NOTHING:
        return 0.0
    return float(tree.stack.body + tree.y.load.mass + tree.y.load.payload)


def _both(what: Callable[[Any], float]) -> Callable[[XY], float]:
    """Limits of both axes together."""
    return lambda tree: round_to(math.hypot(what(tree.x), what(tree.y)))


RULES: tuple[Rule, ...] = (
    ("x.load.payload", _carried_mass),
    *stage_trees.each_rule({name: axis.Axis() for name in AXES}),
    ("path.speed", _both(lambda one: one.motion.velocity)),
    ("path.acceleration", _both(lambda one: one.motion.acceleration)),
    ("path.tolerance", _both(lambda one: one.arrival.tolerance)),
)


def _checks(tree: XY) -> Iterator[Checked]:
    yield from stage_trees.on_one_clock(tree, AXES)
    upper = tree.y.load.mass + tree.y.load.payload
    yield (
        tree.stack.carries == UPPER and tree.x.load.payload < upper,
        "x.load.payload",
        tree.x.load.payload,
        f"{upper:.4g} kg or more, which y moves and x carries; or stack.carries = "
        f'"{NOTHING}" for axes side by side',
    )
    coarse = max(tree.x.encoder.pitch, tree.y.encoder.pitch)
    yield (
        tree.path.tolerance < coarse,
        "path.tolerance",
        tree.path.tolerance,
        f"{1e6 * coarse:.4g} um or more, one count of the coarser encoder",
    )


def _default() -> XY:
    made: Any = XY()
    upper = made.y._replace(load=made.y.load._replace(stop_high=205e-3))
    found: XY = derive_all(made._replace(y=upper))
    return found


DEFAULT: Any = _default()
