"""What a user names as "module:object": imported, and what is wrong with the name in words."""

from __future__ import annotations

import difflib
import importlib
import os
import sys
from collections.abc import Callable
from importlib import metadata
from typing import Any

from macromicro.errors import InputError
from macromicro.schema.text import printable


def spelled(name: str) -> bool:
    """Whether a text has the form "module:object".

    Parameters
    ----------
    name : str
        Anything that a user wrote.

    Returns
    -------
    bool
        True for a dotted name of identifiers, a colon and an identifier.
    """
    module, colon, attribute = name.partition(":")
    parts = (*module.split("."), attribute)
    return bool(colon) and all(part.isidentifier() for part in parts)


def load(name: str, where: str, what: str, suits: Callable[[Any], bool]) -> Any:
    """The object that "module:object" names.

    The module is looked for in the working directory as well.

    Parameters
    ----------
    name : str
        "module:object", well `spelled`.
    where : str
        Option or file and key, for the message.
    what : str
        What the object is to be, such as "a law".
    suits : Callable[[Any], bool]
        Which of the module's objects may be proposed in place of one that is not there.

    Returns
    -------
    Any
        The object; not checked.

    Raises
    ------
    InputError
        No such module, an error raised while it was imported, or no such object in it; with the
        nearest.
    """
    module, _, attribute = name.partition(":")
    here = os.getcwd()
    if here not in sys.path:  # an installed command does not look where the user stands
        sys.path.insert(0, here)
    try:
        there = importlib.import_module(module)
    except ModuleNotFoundError as error:
        itself = f"{module}.".startswith(f"{error.name}.")
        found = f"no module {error.name}" + ("" if itself else f", which {module} imports")
        raise InputError(where, found, "a module here or on PYTHONPATH") from None
    except Exception as error:  # whatever the user's module does
        found = f"importing {module} failed: {type(error).__name__}: {printable(error, 200)}"
        raise InputError(where, found, "a module that can be imported") from error
    made = getattr(there, attribute, None)
    if made is None:
        public = {n: v for n, v in sorted(vars(there).items()) if n[0] != "_" and suits(v)}
        own = [n for n, v in public.items() if not callable(v) or v.__module__ == module]
        near = difflib.get_close_matches(attribute, own, 1, 0.6) or own
        accepted = f"{what} of {module}" + (f", such as {near[0]}" if near else "")
        raise InputError(where, f"no {attribute} in {getattr(there, '__file__', module)}", accepted)
    return made


def registered(group: str) -> dict[str, str]:
    """What installed packages offer.

    Parameters
    ----------
    group : str
        An entry-point group, such as "macromicro.laws".

    Returns
    -------
    dict[str, str]
        Name to "module:object".
    """
    return {point.name: point.value for point in metadata.entry_points(group=group)}


def place(name: str, group: str) -> str | None:
    """Where a user's object is, by the name that the user wrote.

    Parameters
    ----------
    name : str
        "module:object", or the name of an installed entry point.
    group : str
        Of the entry points.

    Returns
    -------
    str | None
        "module:object", for `load`; None for a name that is neither.
    """
    return name if spelled(name) else registered(group).get(name)
