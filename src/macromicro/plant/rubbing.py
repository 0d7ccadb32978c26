"""Friction of an axis: bristles (`friction`), or a part of another package by `FrictionPart`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.kernel import by_type, kernel
from macromicro.place import LENGTH, Place
from macromicro.plant import friction
from macromicro.plant.friction import AxisFriction


class Sheet(NamedTuple):
    """What an engineer reads off a part: what gains, limits and homing of an axis follow from.

    Examples
    --------
    >>> from macromicro.plant.rubbing import Sheet
    >>> Sheet(coulomb=10.0, stribeck=2.0, viscous=6.4).coulomb  # N
    10.0
    """

    coulomb: float  #: kinetic friction, N; N m of an axis that turns
    stribeck: float  #: breakaway above it, N
    viscous: float  #: rise with the speed, N s/m


@kernel
def no_state(p: Any, held: float) -> float:
    """The state of a part that remembers nothing.

    Parameters
    ----------
    p : Any
        Its parameters.
    held : float
        N.

    Returns
    -------
    float
        0.

    Examples
    --------
    >>> from macromicro.plant.rubbing import no_state
    >>> no_state(None, held=2.5)  # N
    0.0
    """
    return 0.0


@kernel
def unchanged(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    """The state after a step of a part that remembers nothing.

    Parameters
    ----------
    p : Any
        Its parameters.
    s : Any
        Its state.
    x, v, h : float
        m, m/s, s.

    Returns
    -------
    Any
        The same state.

    Examples
    --------
    >>> from macromicro.plant.rubbing import unchanged
    >>> unchanged(None, s=0.0, x=0.01, v=0.1, h=5e-5)  # m, m/s, s
    0.0
    """
    return s


class FrictionPart(NamedTuple):
    """Friction of one's own for an axis; in rad and N m on one that turns.

    Examples
    --------
    >>> from typing import Annotated, NamedTuple
    >>> from macromicro.plant.rubbing import FrictionPart
    >>> from macromicro.schema.par import Par
    >>> class Drag(NamedTuple):
    ...     level: Annotated[float, Par("N*s/m", "viscous drag", lo=0.0)] = 2.0
    >>> drag = FrictionPart("drag", Drag, lambda p, s, x, v, h: (0.0, p.level))
    >>> drag.force(Drag(), 0.0, 0.01, 0.1, 5e-5)  # N, N s/m
    (0.0, 2.0)
    """

    name: str  #: for people
    #: A ``NamedTuple`` of floats with defaults, each annotated with a `Par`; a type of its own for
    #: each part
    settings: Any
    #: kernel: from parameters, state, place (m), present speed (m/s) and the step's length (s) to c
    #: (N) and d >= 0 (N s/m). The friction over the step is c + d times the speed after it, which
    #: the axis solves for: what holds a body at rest is a large d, without a small step
    force: Callable[[Any, Any, float, float, float], tuple[float, float]]
    #: from parameters and the force (N) that friction must hold at rest to the state there, a float
    #: or a ``NamedTuple`` of floats
    start: Callable[[Any, float], Any] = no_state
    #: kernel: from parameters, state, place, the speed after the step and its length to the new
    #: state
    after: Callable[[Any, Any, float, float, float], Any] = unchanged
    #: from parameters to what gains and limits follow from. None: the settings `friction` say it
    sheet: Callable[[Any], Sheet] | None = None
    #: A table of what is not known about it, with paths from the part's own parameters on, for
    #: `robust`
    spread: Path | None = None
    place: Place = LENGTH  #: what its axis is counted in: `LENGTH` or `ANGLE`


_parts: dict[type, FrictionPart] = {}  # by the type of their parameters


def known(part: FrictionPart) -> FrictionPart:
    """Make a part known by the type of its parameters.

    Parameters
    ----------
    part : FrictionPart
        To be looked up.

    Returns
    -------
    FrictionPart
        That of the type, which another part may have taken before.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> from macromicro.plant.rubbing import FrictionPart, known, terms
    >>> class Drag(NamedTuple):
    ...     level: float = 2.0  # N s/m
    >>> drag = known(FrictionPart("drag", Drag, lambda p, s, x, v, h: (0.0, p.level)))
    >>> terms(Drag(), 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 5e-5)  # 0 N + 2 N s/m times the speed
    (0.0, 0.0, 0.0, 2.0)
    """
    return _parts.setdefault(part.settings, part)


def begun(p: Any, held: float) -> Any:
    """What an axis' friction remembers at rest.

    Parameters
    ----------
    p : Any
        `AxisFriction`, or parameters of a part.
    held : float
        Force that it must hold, towards lower positions, N.

    Returns
    -------
    Any
        Deflection of the bristles, m; or a part's state.

    Examples
    --------
    >>> from macromicro.plant.friction import AxisFriction
    >>> from macromicro.plant.rubbing import begun
    >>> sheet = AxisFriction(coulomb=10.0, stribeck=0.0, presliding=1e-5)  # N, N, m
    >>> begun(sheet, held=5.0)  # N; the deflection in m
    -5e-06
    """
    if not isinstance(p, AxisFriction):
        return _parts[type(p)].start(p, held)
    stiffness, _ = friction.before_sliding(p, 0.0)
    return -min(held, p.coulomb) / stiffness if stiffness > 0.0 else 0.0


def _offset(p: Any, x: Any) -> Callable[..., Any]:
    if p.instance_class is AxisFriction:
        return friction.ripple
    return lambda p, x: 0.0


@by_type(_offset)
def offset(p: Any, x: float) -> float:
    """Deviation of the level of bristles at a place; what a part does at a place is its `force`.

    Parameters
    ----------
    p : Any
        `AxisFriction`, or parameters of a part.
    x : float
        m.

    Returns
    -------
    float
        N.

    Examples
    --------
    >>> from macromicro.plant.friction import AxisFriction
    >>> from macromicro.plant.rubbing import offset
    >>> round(offset(AxisFriction(ripple=0.5), 0.01), 2)  # N, at 10 mm
    0.24
    """
    return friction.ripple(p, x) if isinstance(p, AxisFriction) else 0.0


def _viscous(p: Any) -> Callable[..., Any]:
    if p.instance_class is AxisFriction:
        return lambda p: p.viscous
    return lambda p: 0.0


@by_type(_viscous)
def viscous(p: Any) -> float:
    """Viscous friction beside `terms`.

    Parameters
    ----------
    p : Any
        `AxisFriction`, or parameters of a part.

    Returns
    -------
    float
        N s/m; 0 of a part, whose `force` has all.

    Examples
    --------
    >>> from macromicro.plant.friction import AxisFriction
    >>> from macromicro.plant.rubbing import viscous
    >>> viscous(AxisFriction(viscous=6.4))  # N s/m
    6.4
    """
    return float(p.viscous) if isinstance(p, AxisFriction) else 0.0


Terms = tuple[float, float, float, float]


def _terms(
    p: Any, s: Any, x: Any, v: Any, level: Any, stiffness: Any, damping: Any, h: Any
) -> Callable[..., Any]:
    if p.instance_class is AxisFriction:
        return lambda p, s, x, v, level, stiffness, damping, h: friction.bristle_terms(
            p, stiffness, damping, s, v, level, h
        )
    force = _parts[p.instance_class].force

    def chosen(
        p: Any, s: Any, x: float, v: float, level: float, stiffness: float, damping: float, h: float
    ) -> Terms:
        c, d = force(p, s, x, v, h)
        return 0.0, 0.0, c, d

    return chosen


@by_type(_terms)
def terms(
    p: Any, s: Any, x: float, v: float, level: float, stiffness: float, damping: float, h: float
) -> Terms:
    """An axis' friction over a step, linear in the speed v1 after it.

    Parameters
    ----------
    p : Any
        `AxisFriction`, or parameters of a part.
    s : Any
        What it remembers.
    x, v : float
        Place and present speed, m and m/s.
    level : float
        Of `offset`, N.
    stiffness, damping : float
        Before sliding, N/m and N s/m.
    h : float
        Length of the step, s.

    Returns
    -------
    a, b : float
        Deflection of bristles after the step, a + b v1, m and s; 0 of a part.
    c, d : float
        Force, c + d v1, N and N s/m.

    Examples
    --------
    >>> from macromicro.plant.friction import AxisFriction
    >>> from macromicro.plant.rubbing import terms
    >>> a, b, c, d = terms(AxisFriction(), 0.0, 0.0, 0.0, 0.0, 7e5, 570.0, 5e-5)  # at rest
    >>> a, b, c, round(d, 1)  # m, s, N, N s/m
    (0.0, 5e-05, 0.0, 605.0)
    """
    if isinstance(p, AxisFriction):
        return friction.bristle_terms(p, stiffness, damping, s, v, level, h)
    c, d = _parts[type(p)].force(p, s, x, v, h)
    return 0.0, 0.0, c, d


def _after(p: Any, s: Any, z: Any, x: Any, v: Any, h: Any) -> Callable[..., Any]:
    if p.instance_class is AxisFriction:
        return lambda p, s, z, x, v, h: z
    after = _parts[p.instance_class].after
    return lambda p, s, z, x, v, h: after(p, s, x, v, h)


@by_type(_after)
def after(p: Any, s: Any, z: float, x: float, v: float, h: float) -> Any:
    """What an axis' friction remembers after a step.

    Parameters
    ----------
    p : Any
        `AxisFriction`, or parameters of a part.
    s : Any
        What it remembered.
    z : float
        Deflection of bristles by `terms`, m.
    x, v : float
        Place before the step and speed after it, m and m/s.
    h : float
        Length of the step, s.

    Returns
    -------
    Any
        As `begun`.

    Examples
    --------
    >>> from macromicro.plant.friction import AxisFriction
    >>> from macromicro.plant.rubbing import after
    >>> after(AxisFriction(), 0.0, 1e-6, 0.01, 0.1, 5e-5)  # of bristles, their deflection, m
    1e-06
    """
    return z if isinstance(p, AxisFriction) else _parts[type(p)].after(p, s, x, v, h)
