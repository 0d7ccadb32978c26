"""Kinds of commissioning: a file each and a line here, or a user's module."""

from __future__ import annotations

from macromicro.commission import axis, piezo, rotary, wire
from macromicro.commission.procedure import Kind
from macromicro.errors import ProblemError
from macromicro.schema import plugins
from macromicro.schema.text import printable

KINDS: tuple[Kind, ...] = (axis.KIND, piezo.KIND, wire.KIND, rotary.KIND)
NAMES = tuple(kind.name for kind in KINDS)
GROUP = "macromicro.commissions"
FORM = "MODULE:KIND of your own"


def by_name(name: str) -> Kind | None:
    found = next((kind for kind in KINDS if kind.name == name), None)
    installed = plugins.entry_points(GROUP).get(name)
    if found is None and installed is not None:
        return _of_others(installed, f"the machine {printable(name)}")
    return found


def choose(name: str, where: str) -> Kind:
    found = next((kind for kind in KINDS if kind.name == name), None)
    return _of_others(name, where) if found is None else found


def _of_others(name: str, where: str) -> Kind:
    made: Kind = plugins.Group(GROUP, "a kind", Kind, FORM, NAMES).find(name, where)
    if not made.steps:
        raise ProblemError(where, f"{printable(name)} has no steps", "A kind needs one or more.")
    return made
