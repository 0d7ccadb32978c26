"""Parts of other packages that settings name."""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro import joining
from macromicro.errors import InputError, ProblemError
from macromicro.kernel import is_kernel
from macromicro.plant import rubbing
from macromicro.plant.rubbing import FrictionPart
from macromicro.schema import plugins
from macromicro.schema.keys import nearest
from macromicro.schema.par import entries
from macromicro.schema.text import printable

GROUP = "macromicro.parts"
BRISTLES = "bristles"  # the friction of this package
FORM = "MODULE:PART, a part of your own (docs/own-parts.md)"
_FUNCTIONS = ("force", "start", "after")


class NoPart(NamedTuple):
    pass


_found: dict[str, FrictionPart] = {}


def find(name: str, where: str) -> FrictionPart:
    """The part of a name, imported at the first call."""
    if name not in _found:
        part = checked(imported(name, where), name, where)
        if rubbing.known(part) != part:
            problem = f"{printable(name)} has the settings of another, {part.settings.__name__}"
            raise ProblemError(where, problem, "Give each part a type of settings of its own.")
        _found[name] = part
        if compiles(part):
            joining.admitted(name, part.force, part.after)
    return _found[name]


def imported(name: str, where: str) -> Any:
    """The object under a part's name in a user's module."""
    place = plugins.place(name, GROUP)
    if place is None:
        accepted = f"{nearest(name, (BRISTLES, *plugins.registered(GROUP)))}; or {FORM}"
        raise InputError(where, printable(name), accepted)
    return plugins.load(place, where, "a part", lambda made: isinstance(made, FrictionPart))


def checked(made: Any, name: str, where: str) -> FrictionPart:
    """That object, checked."""
    if not isinstance(made, FrictionPart):
        found = f"{printable(name)}, {type(made).__name__}"
        raise InputError(where, found, "a macromicro.plant.rubbing.FrictionPart")
    kind: Any = made.settings
    floats = "a NamedTuple of floats with defaults, each annotated with a Par"
    if not (isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")):
        raise InputError(f"{where}, settings of {name}", printable(kind), floats)
    defaults: Any = getattr(kind, "_field_defaults", {})
    whole = len(defaults) == len(kind._fields) > 0
    if not whole or len([e for e in entries(kind()) if e.number]) < len(defaults):
        raise InputError(f"{where}, settings of {name}", kind.__name__, floats)
    for each in _FUNCTIONS:
        if not callable(getattr(made, each)):
            found = printable(getattr(made, each))
            raise InputError(f"{where}, {each} of {name}", found, "a function")
    return made


def compiles(part: FrictionPart) -> bool:
    return is_kernel(part.force) and is_kernel(part.after)


def digest(name: str) -> str:
    """Digest of a part's sources."""
    part = _found[name]
    return joining.sources(part.force, part.settings, also=compiles(part))
