"""Kinds of commissioning: a file each and a line here, or a user's module."""

from __future__ import annotations

from macromicro.commission import axis, piezo, rotary, wire
from macromicro.commission.procedure import Kind
from macromicro.errors import InputError, ProblemError
from macromicro.schema import plugins
from macromicro.schema.text import printable

KINDS: tuple[Kind, ...] = (
    axis.KIND,
    piezo.KIND,
    wire.KIND,
    rotary.KIND,
)
NAMES = tuple(kind.name for kind in KINDS)
GROUP = "macromicro.commissions"
FORM = "MODULE:KIND of your own"


def named(name: str) -> Kind | None:
    found = next((kind for kind in KINDS if kind.name == name), None)
    place = plugins.registered(GROUP).get(name)
    if found is None and place is not None:
        return _loaded(place, f"the machine {printable(name)}")
    return found


def chosen(name: str, where: str) -> Kind:
    for kind in KINDS:
        if kind.name == name:
            return kind
    place = plugins.place(name, GROUP)
    if place is None:
        every = ", ".join((*NAMES, *plugins.registered(GROUP)))
        raise InputError(where, printable(name), f"one of {every}; or {FORM}")
    return _loaded(place, where)


def _loaded(place: str, where: str) -> Kind:
    made = plugins.load(place, where, "a kind", lambda it: isinstance(it, Kind))
    if not isinstance(made, Kind):
        found = f"{place}, {type(made).__name__}"
        raise InputError(where, found, "a macromicro.commission.procedure.Kind")
    if not made.steps:
        raise ProblemError(where, f"{place} has no steps", "A kind needs one or more.")
    return made
