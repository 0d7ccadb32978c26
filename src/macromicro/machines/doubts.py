"""Uncertain derived settings, for `config show`, reports, `robust` and `tune`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from macromicro import place as places
from macromicro.errors import InputError
from macromicro.machines import deriving
from macromicro.schema.par import entries, is_given, value_at

FAR = 20.0  # times the encoder's resolution
COARSE = 5e-3  # of the travel
ARRIVAL, CONTOUR = "arrival.tolerance", "path.tolerance"


class Doubt(NamedTuple):
    """An uncertain derived setting."""

    path: str
    value: str
    reason: str  # why it is so large, and what that means

    @property
    def text(self) -> str:
        return f"{self.path} = {self.value} {self.reason}; set it to the error that you accept"


def _arrival(tree: Any) -> str:
    """A tolerance far above the encoder's resolution, or a good part of the travel."""
    value, place = tree.arrival.tolerance, places.of(tree)
    way, cause, shown = tree.travel.high - tree.travel.low, "what the sensor shows", value
    if hasattr(tree, "drive"):  # an axis, or one that turns
        shown, cause = deriving.smallest_error(tree), max(deriving.nearest(tree))[1]
    if value > FAR * shown:
        much = f"{value / shown:.0f} times the {place.told(shown, digits=3)} that the encoder shows"
    elif value > COARSE * way:
        much = f"{value / way:.1%} of the travel"
    else:
        return ""
    return f"follows from {cause}. It is {much}, and a move arrives anywhere within it"


RULES: tuple[tuple[str, Callable[[Any], str]], ...] = ((ARRIVAL, _arrival),)


def find_doubts(tree: Any) -> tuple[Doubt, ...]:
    """Uncertain derived settings of a machine."""
    stages = [
        (n, own) for n, own in zip(tree._fields, tree, strict=True) if hasattr(own, "derived")
    ]
    if not stages:
        return tuple(_of(tree, RULES))
    each = [
        one._replace(path=f"{name}.{one.path}") for name, own in stages for one in find_doubts(own)
    ]
    why = " and ".join(one.path for one in each if one.path.endswith(ARRIVAL))
    if not why or not hasattr(tree, "path"):
        return tuple(each)
    return (*each, *_of(tree, ((CONTOUR, lambda _: f"follows from {why}, which is in doubt"),)))


def _of(tree: Any, rules: tuple[tuple[str, Callable[[Any], str]], ...]) -> list[Doubt]:
    derived, known = dict(tree.derived()), {e.path: e.par for e in entries(tree)}
    doubts = []
    for path, rule in rules:
        if path not in derived or is_given(tree, path):
            continue
        value = value_at(tree, path)
        if value == derived[path](tree) and (reason := rule(tree)):
            doubts.append(Doubt(path, known[path].spoken(value, 4), reason))
    return doubts


def refuse(tree: Any, file: str, what: str) -> None:
    """Refuse settings with an uncertain value that decides the result."""
    for each in find_doubts(tree):
        accepted = (
            f"a value set in the file: {what} depends on it, and the derived one {each.reason}"
        )
        raise InputError(f"{file}, {each.path}", each.value, accepted)
