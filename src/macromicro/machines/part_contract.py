"""Checks that a friction part of another package meets the contract."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from macromicro.control.contract import Broken, Finding, Look, looked
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.plant import own_part
from macromicro.plant.rubbing import FrictionPart
from macromicro.schema.par import entries
from macromicro.schema.text import printable

STEP = 5e-5  # s
SPEEDS = (1e-4, 1e-3, 1e-2, 0.1)  # m/s
_SLIDING = 2000  # steps at each speed
_MASS = 0.5  # kg
_LINEAR = "force(p, s, x, v, h) -> (c, d): floats, d at least 0"


def check(part: FrictionPart | Any, name: str = "the part") -> Iterator[Finding]:
    """Check a part on simulated motion.

    Parameters
    ----------
    part : FrictionPart | Any
        What a user's module offers.
    name : str, optional
        Its name, for messages.

    Yields
    ------
    Finding
        Each result; checks that depend on a failed one are skipped.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> from macromicro.machines.part_contract import check
    >>> from macromicro.plant.rubbing import FrictionPart
    >>> class Drag(NamedTuple):
    ...     level: float = 2.0  # which lacks a `Par` with its unit and bounds
    >>> drag = FrictionPart("drag", Drag, lambda p, s, x, v, h: (0.0, p.level))
    >>> [(each.what, each.passed) for each in check(drag)]
    [('shape', False)]
    """
    try:
        part = own_part.checked(part, name, "part")
    except InputError as error:
        yield Finding("shape", False, f"{error.where}: {error.value}", error.accepted)
        return
    yield Finding("shape", True, f"settings {', '.join(part.settings._fields)}")
    looks: tuple[tuple[str, Look], ...] = (
        ("settings", _settings),
        ("force", _force),
        ("direction", _direction),
        ("rest", _rest),
        ("sheet", _sheet),
        ("compiled", _compiled),
    )
    yield from looked(part, looks, ("force",))


def broken(part: FrictionPart | Any, name: str = "the part") -> list[str]:
    """The failed checks of a part, for a test.

    Parameters
    ----------
    part : FrictionPart | Any
        What a user's module offers.
    name : str, optional
        Its name, for messages.

    Returns
    -------
    list[str]
        A line for each; empty for a good part.

    Examples
    --------
    >>> from macromicro.machines.part_contract import broken
    >>> broken("no part")
    ['shape: part: the part, str; a macromicro.plant.rubbing.FrictionPart']
    """
    return [f"{f.what}: {f.found}; {f.remedy}" for f in check(part, name) if not f.passed]


def slid(part: FrictionPart, p: Any, v: float, steps: int = _SLIDING) -> tuple[Any, float]:
    """The friction of a part that slides at a steady speed.

    Parameters
    ----------
    part : FrictionPart
        That is slid.
    p : Any
        Its parameters.
    v : float
        m/s.
    steps : int, optional
        Of `STEP` s.

    Returns
    -------
    state : Any
        At the end.
    force : float
        Mean over the second half, N.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> from macromicro.machines.part_contract import slid
    >>> from macromicro.plant.rubbing import FrictionPart
    >>> class Drag(NamedTuple):
    ...     level: float = 2.0  # N s/m
    >>> drag = FrictionPart("drag", Drag, lambda p, s, x, v, h: (0.0, p.level))
    >>> state, force = slid(drag, Drag(), v=0.1)  # m/s
    >>> round(force, 6)  # N
    0.2
    """
    s, x, total = part.start(p, 0.0), 0.0, 0.0
    for k in range(steps):
        c, d = _answered(part.force(p, s, x, v, STEP))
        s = part.after(p, s, x, v, STEP)
        x += STEP * v
        total += (c + d * v) * (2 * k >= steps)
    return s, total / (steps - (steps + 1) // 2)


def _answered(answer: Any) -> tuple[float, float]:
    if not (isinstance(answer, tuple) and len(answer) == 2):
        raise Broken(f"force gives {printable(answer)[:80]}", _LINEAR)
    c, d = answer
    for value in answer:
        if not isinstance(value, float) or not math.isfinite(value):
            raise Broken(f"force gives {printable(value)[:80]}", _LINEAR)
    if d < 0.0:
        raise Broken(f"d is {d:.4g}: it would drive the axis", _LINEAR)
    return c, d


def _settings(part: FrictionPart) -> str:
    p = part.settings()
    for entry in entries(p):
        if not entry.admits(entry.value):
            found = f"{entry.path} = {entry.par.spoken(entry.value)}"
            raise Broken(found, f"a default within its bounds: {entry.accepted}")
    return "each default is within its bounds"


def _force(part: FrictionPart) -> str:
    p = part.settings()
    kept = part.start(p, 0.0)
    for held in (part.start(p, 0.0), part.after(p, kept, 0.0, 0.01, STEP)):
        if type(held) is not type(kept) or not _floats(held):
            found = f"state {printable(held)[:80]}"
            raise Broken(found, "a float, or a NamedTuple of floats, of one type")
    for v in (-1.0, 0.0, 1.0):
        _answered(part.force(p, kept, 0.0, v, STEP))
    return "finite, of one type of state"


def _floats(state: Any) -> bool:
    items = state if isinstance(state, tuple) else (state,)
    return all(isinstance(each, float) and math.isfinite(each) for each in items)


def _direction(part: FrictionPart) -> str:
    p = part.settings()
    for v in (*SPEEDS, *(-v for v in SPEEDS)):
        _, force = slid(part, p, v)
        if force * v < 0.0:
            found = f"{force:.4g} N at {v:g} m/s: it drives the axis"
            raise Broken(found, "friction acts against the motion: a positive force at v > 0")
    return "against the motion at all speeds"


def _rest(part: FrictionPart) -> str:
    """Check that a body which it brakes comes to rest."""
    p = part.settings()
    s, x, v = part.start(p, 0.0), 0.0, 0.05
    for _ in range(4 * _SLIDING):
        c, d = _answered(part.force(p, s, x, v, STEP))
        new = (_MASS * v - STEP * c) / (_MASS + STEP * d)
        s = part.after(p, s, x, new, STEP)
        x, v = x + 0.5 * STEP * (v + new), new
        if abs(v) > 0.1 or not math.isfinite(v):
            raise Broken(f"{_MASS:g} kg at 0.05 m/s is accelerated", "a passive force")
    return f"{_MASS:g} kg at 0.05 m/s has {abs(v):.2g} m/s after {4 * _SLIDING * STEP:g} s"


def _sheet(part: FrictionPart) -> str:
    if part.sheet is None:
        return "none: say friction.coulomb, stribeck and viscous in the settings"
    p = part.settings()
    told, least, most = part.sheet(p), math.inf, 0.0
    for name in ("coulomb", "stribeck", "viscous"):
        value = getattr(told, name, None)
        if not isinstance(value, float) or not 0.0 <= value < math.inf:
            raise Broken(f"{name} {printable(value)[:80]}", "a rubbing.Sheet of floats from 0 on")
    for v in SPEEDS:
        _, force = slid(part, p, v)
        least, most = min(least, force), max(most, force)
    far = told.coulomb + told.stribeck + told.viscous * SPEEDS[-1]
    if not 0.5 * least <= told.coulomb <= 2.0 * most or far < 0.5 * most:
        found = f"coulomb {told.coulomb:.4g} N, but it slides with {least:.4g} to {most:.4g} N"
        raise Broken(found, "what the part does: gains and limits follow from it")
    return f"coulomb {told.coulomb:.4g} N; it slides with {least:.4g} to {most:.4g} N"


def _compiled(part: FrictionPart) -> str:
    if not own_part.compiles(part):
        return "no: plain Python, it runs interpreted; mark force and after with @kernel for speed"
    p = part.settings()
    force, after = compiled(part.force), compiled(part.after)
    s = part.start(p, 0.0)
    for k in range(200):
        v = 0.1 * math.sin(0.1 * k)
        try:
            fast = force(p, s, 1e-4 * k, v, STEP), after(p, s, 1e-4 * k, v, STEP)
        except Exception as error:
            words = " ".join(str(error).split())[:200]
            remedy = "floats, math and NamedTuples alone (CONTRIBUTING.md, Kernels)"
            raise Broken(f"it does not compile: {words}", remedy) from None
        slow = part.force(p, s, 1e-4 * k, v, STEP), part.after(p, s, 1e-4 * k, v, STEP)
        if fast != slow:
            raise Broken(f"other bits than interpreted at {v:g} m/s", "x * x for x**2, no hypot")
        s = slow[1]
    return "yes, with the same force"
