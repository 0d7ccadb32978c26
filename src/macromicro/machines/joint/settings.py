"""Settings of the machine `xy`: two whole axes, what one carries of the other, and the path."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from macromicro.machines import axis, owned
from macromicro.machines.rounding import rounded
from macromicro.machines.tree import Checked, Problem, Rule, settled, under_law, with_
from macromicro.schema.par import Par, changed

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
    """Limits along the path."""

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
    """What the bench has, and no law, guard or data sheet knows."""

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
    """The tree behind ``machine = "xy"``; `DEFAULT` has what is derived filled in."""

    stack: Stack = Stack()
    path: Along = Along()
    hidden: Hidden = Hidden()
    x: Any = axis.Axis()
    y: Any = axis.Axis()

    def derived(self) -> tuple[Rule, ...]:
        """What follows from other settings.

        Returns
        -------
        tuple[Rule, ...]
            Paths and rules, none of which depends on a later one.
        """
        return RULES

    def together(self) -> list[Problem]:
        """What cannot work together, beside what each axis finds in itself.

        Returns
        -------
        list[Problem]
            Path, value, and what is accepted and why.
        """
        return [(path, value, words) for wrong, path, value, words in _checks(self) if wrong]

    def grown(self, table: Mapping[str, object], where: str) -> XY:
        """With the gains of the laws, and the parts, that a table of settings names.

        Parameters
        ----------
        table : Mapping[str, object]
            Of a file; paths dotted or nested.
        where : str
            The file, for messages.

        Returns
        -------
        XY
            A copy.
        """
        laws: dict[str, Any] = {}
        parts: dict[str, Any] = {}
        for name in AXES:
            own, there, one = table.get(name), f"{where}, {name}", getattr(self, name)
            told = dict(own) if isinstance(own, Mapping) else {}
            told |= {k[2:]: v for k, v in table.items() if k.startswith(f"{name}.")}
            laws[name] = under_law(one, told, there)
            found = owned.named(one, told, there).items()
            parts |= {f"{name}.{path}": value for path, value in found}
        made = self._replace(**laws)
        if parts:
            made = changed(made, parts)
        return made

    def with_(self, changes: str | Mapping[str, object], value: object = None) -> XY:
        """These settings with other values, and with what follows from them.

        Parameters
        ----------
        changes : str | Mapping[str, object]
            Path of a parameter; or several paths with their values.
        value : object, optional
            Of the one path.

        Returns
        -------
        XY
            A changed copy.
        """
        return with_(self, changes, value)


def of(tree: XY) -> tuple[Any, Any]:
    """The settings of each axis.

    Parameters
    ----------
    tree : XY
        Settings.

    Returns
    -------
    tuple[Any, Any]
        In the order of `AXES`.
    """
    return tree.x, tree.y


def _carried(tree: XY) -> float:
    """All that x carries of y."""
    if tree.stack.carries == NOTHING:
        return 0.0
    return float(tree.stack.body + tree.y.load.mass + tree.y.load.payload)


def _within(name: str, rule: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A rule of one axis as one of the whole tree."""
    return lambda tree: rule(getattr(tree, name))


def _both(what: Callable[[Any], float]) -> Callable[[XY], float]:
    """What both axes do together, at right angles."""
    return lambda tree: rounded(math.hypot(what(tree.x), what(tree.y)))


_OWN: Any = axis.Axis
_RULES: tuple[Rule, ...] = _OWN().derived()
RULES: tuple[Rule, ...] = (
    ("x.load.payload", _carried),
    *((f"{name}.{path}", _within(name, rule)) for name in AXES for path, rule in _RULES),
    ("path.speed", _both(lambda one: one.motion.velocity)),
    ("path.acceleration", _both(lambda one: one.motion.acceleration)),
    ("path.tolerance", _both(lambda one: one.arrival.tolerance)),
)


def _checks(tree: XY) -> Iterator[Checked]:
    """What the axes cannot do together."""
    yield (
        tree.x.timing.period != tree.y.timing.period,
        "y.timing.period",
        tree.y.timing.period,
        "{x.timing.period}: both axes run on one clock",
    )
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
    found: XY = settled(made._replace(y=upper))
    return found


DEFAULT: Any = _default()
