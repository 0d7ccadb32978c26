"""Parts of other packages, named in the settings of a machine, found when asked for."""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro import joining
from macromicro.errors import InputError
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
    """The parameters of no part of another package."""


_found: dict[str, FrictionPart] = {}


def find(name: str, where: str) -> FrictionPart:
    """The part of a name, imported at the first call.

    Parameters
    ----------
    name : str
        "module:object", or that of an entry point of the group `GROUP`.
    where : str
        Option or file and key, for messages.

    Returns
    -------
    FrictionPart
        The part.

    Raises
    ------
    InputError
        It is not to be had, or is no part.
    """
    if name not in _found:
        part = checked(imported(name, where), name, where)
        if rubbing.known(part) != part:
            found = f"{printable(name)} has the settings of another, {part.settings.__name__}"
            raise InputError(where, found, "a type of settings of its own for each part")
        _found[name] = part
        if compiles(part):
            joining.admitted(name, part.force, part.after)
    return _found[name]


def imported(name: str, where: str) -> Any:
    """What a user's module has under a part's name.

    Parameters
    ----------
    name : str
        As for `find`.
    where : str
        Option or file and key, for messages.

    Returns
    -------
    Any
        Not checked.

    Raises
    ------
    InputError
        It is not to be had.
    """
    place = plugins.place(name, GROUP)
    if place is None:
        accepted = f"{nearest(name, (BRISTLES, *plugins.registered(GROUP)))}; or {FORM}"
        raise InputError(where, printable(name), accepted)
    return plugins.load(place, where, "a part", lambda made: isinstance(made, FrictionPart))


def checked(made: Any, name: str, where: str) -> FrictionPart:
    """What a user's module has under a part's name, as a part.

    Parameters
    ----------
    made : Any
        A `FrictionPart`.
    name : str
        Of it.
    where : str
        Option or file and key, for messages.

    Returns
    -------
    FrictionPart
        The part.

    Raises
    ------
    InputError
        It has not the shape of a part.
    """
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
    """Whether a part is meant to be compiled.

    Parameters
    ----------
    part : FrictionPart
        The part.

    Returns
    -------
    bool
        True if its `force` and `after` are kernels.
    """
    return is_kernel(part.force) and is_kernel(part.after)


def digest(name: str) -> str:
    """What the sources of a part are: an edit of it makes another digest.

    Parameters
    ----------
    name : str
        Of a part that was found.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    part = _found[name]
    return joining.sources(part.force, part.settings, also=compiles(part))
