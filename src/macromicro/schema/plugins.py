"""Objects that a user names as "module:object": import and error messages."""

from __future__ import annotations

import difflib
import importlib
import os
import sys
from collections.abc import Callable
from importlib import metadata
from typing import Any, NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.schema.keys import nearest
from macromicro.schema.text import printable

_MANY = 12  # names that are not all listed


def is_plugin_name(name: str) -> bool:
    """Whether a text has the form "module:object"."""
    module, colon, attribute = name.partition(":")
    parts = (*module.split("."), attribute)
    return bool(colon) and all(part.isidentifier() for part in parts)


def load(name: str, where: str, what: str, suits: Callable[[Any], bool]) -> Any:
    """The object that "module:object" names; the working directory is searched as well."""
    module, _, attribute = name.partition(":")
    here = os.getcwd()
    if here not in sys.path:  # an installed command does not look where the user stands
        sys.path.insert(0, here)
    try:
        there = importlib.import_module(module)
    except ModuleNotFoundError as error:
        itself = f"{module}.".startswith(f"{error.name}.")
        found = f"no module {error.name}" + ("" if itself else f", which {module} imports")
        raise ProblemError(
            where, found, "Put the module in this folder or on PYTHONPATH."
        ) from None
    except Exception as error:  # whatever the user's module does
        found = f"importing {module} failed: {type(error).__name__}: {printable(error, 200)}"
        raise ProblemError(where, found) from error
    made = getattr(there, attribute, None)
    if made is None:
        public = {n: v for n, v in sorted(vars(there).items()) if n[0] != "_" and suits(v)}
        own = [n for n, v in public.items() if not callable(v) or v.__module__ == module]
        near = difflib.get_close_matches(attribute, own, 1, 0.6) or own
        accepted = f"{what} of {module}" + (f", such as {near[0]}" if near else "")
        missing = f"no {attribute} in {getattr(there, '__file__', module)}"
        raise ProblemError(where, missing, f"Expected: {accepted}.")
    return made


def entry_points(group: str) -> dict[str, str]:
    """What installed packages offer under an entry point group."""
    return {point.name: point.value for point in metadata.entry_points(group=group)}


def place(name: str, group: str) -> str | None:
    """The "module:object" of a name that the user wrote, if any."""
    return name if is_plugin_name(name) else entry_points(group).get(name)


class Group(NamedTuple):
    """Objects of one type that a user may bring."""

    name: str  # of the entry points
    what: str  # such an object, for messages
    kind: type
    form: str  # how one is named, for messages
    known: tuple[str, ...] = ()  # names of those that this package has

    def find(self, name: object, where: str) -> Any:
        """The object that a user named: "module:object", or an entry point."""
        there = place(name, self.name) if isinstance(name, str) else None
        if there is None:
            every = (*self.known, *entry_points(self.name))
            many = len(every) > _MANY
            near = nearest(str(name), every) if many else f"one of {', '.join(every)}"
            raise InputError(where, printable(name), f"{near}; or {self.form}")
        made = load(there, where, self.what, lambda it: isinstance(it, self.kind))
        if not isinstance(made, self.kind):
            accepted = f"a {self.kind.__module__}.{self.kind.__name__}"
            raise InputError(where, f"{there}, {type(made).__name__}", accepted)
        return made
