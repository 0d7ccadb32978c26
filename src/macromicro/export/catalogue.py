"""Exportable units, by name."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from macromicro.control import outside
from macromicro.control.stage_law import StageLaw
from macromicro.errors import InputError
from macromicro.export import kinds
from macromicro.export._units import of_machine, parts, two_stage
from macromicro.export.units import Entry, Made, Unit, law_of
from macromicro.kernel import is_kernel
from macromicro.machines import compositions
from macromicro.machines import machine as machines
from macromicro.schema import plugins
from macromicro.schema.config import load_overrides
from macromicro.schema.text import printable
from macromicro.settings import Settings


def every(config: Path | None = None) -> Made:
    """All units of a machine's settings; without them, of all machines with their defaults."""
    found: Made = {}
    if config is not None:
        if compositions.is_two_stage(config):
            return two_stage(load_overrides(config, Settings()))
        whole = compositions.of_file(config).name
        for name, machine, settings in compositions.each(config):
            own = machine._replace(name=f"{whole}.{name}") if name else machine
            found |= of_machine(own, settings)
        return found
    found |= two_stage(Settings())
    for machine in machines.MACHINES:
        found |= of_machine(machine, machine.settings)
    return found | parts(Settings())


def unit(what: str, config: Path | None = None) -> Unit:
    units = every(config)
    if what in units:
        return units[what]()
    if outside.is_name(what):
        return _own_unit(what)
    near = difflib.get_close_matches(what, units, 1)
    names = ", ".join(units)
    accepted = f"{near[0]!r}? One of {names}" if near else f"one of {names}"
    raise InputError("WHAT", printable(what), f"{accepted}; or MODULE:LAW, a law of your own")


def _own_unit(what: str) -> Unit:
    place = outside.place(what)
    assert place is not None  # as `is_name` says
    made = plugins.load(place, "WHAT", "a law or a kernel", lambda it: is_kernel(it) or _law(it))
    name = what.partition(":")[2] or what
    if is_kernel(made):
        return alone(name, made)
    law = outside.find(what, "WHAT")
    return law_of(name, law, law.gains(), 1e-3)


def _law(made: Any) -> bool:
    return isinstance(made, StageLaw) or hasattr(made, "step")


def alone(name: str, function: Callable[..., Any]) -> Unit:
    hints = kinds.hints_of(function)
    arguments = []
    for parameter in inspect.signature(function).parameters:
        try:
            arguments.append(kinds.of_hint(hints.get(parameter, Any)))
        except kinds.Unlike as error:
            where = f"{function.__module__}.{function.__qualname__}, {parameter}"
            accepted = "float, int, bool, or a NamedTuple of them"
            raise InputError(where, str(error), accepted) from None
    entry = Entry("go", function, tuple(arguments))
    return Unit(name, words_of(function), (entry,), {})


def words_of(function: Callable[..., Any]) -> str:
    """The first line of a kernel's docstring, or its name."""
    text = inspect.getdoc(function) or function.__name__
    return text.partition("\n")[0].rstrip(".")
