"""What every tree of settings of a single-stage machine has beside its sets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Annotated, Any, NamedTuple, TypeVar, cast

from macromicro.control import outside
from macromicro.control.correction import Correction, NoCorrection
from macromicro.control.stage_law import StageLaw
from macromicro.errors import InputError, ProblemError
from macromicro.place import as_rotary
from macromicro.place import of as place_of
from macromicro.schema import access, plugins
from macromicro.schema.keys import nearest
from macromicro.schema.par import Given, Par, extended, replaced, value_at
from macromicro.schema.text import printable

Tree = TypeVar("Tree")
Problem = tuple[str, Any, str]  # path, value, what is accepted and why
Checked = tuple[bool, str, Any, str]  # whether it is one, and the problem
Rule = tuple[str, Callable[[Any], Any]]

LAW, OWN = "law", "own"  # keys of a settings file: the law's name, and the gains of one's own
PART = "friction.part"
CORRECTION = "correction"  # set that a calibration adds
GIVEN = "given"  # field: what a user has set of derived values


def machine_tree(
    law: StageLaw,
    rules: tuple[Rule, ...] = (),
    problems: Callable[[Any], list[Problem]] = lambda tree: [],
) -> Callable[[type[Tree]], type[Tree]]:
    """Decorator of the ``NamedTuple`` of a machine's settings; adds `law`, `own` and methods."""
    word = Par("", "control law, or MODULE:LAW of your own", "machine choice", choices=(law.name,))
    own = {LAW: (Annotated[str, word], law.name), OWN: (Any, outside.NoGains())}
    fields = own | {CORRECTION: (Any, NoCorrection()), GIVEN: (Given, Given())}

    def made(base: type[Tree]) -> type[Tree]:
        found: Any = extended(base, fields, next(iter(base.__annotations__)))
        found.derived = lambda tree: rules
        found.together = problems
        found.with_ = with_
        found.also = _extra_laws
        found.grown = _with_law
        return cast("type[Tree]", found)

    return made


def with_(tree: Tree, changes: str | Mapping[str, object], value: object = None) -> Tree:
    """Settings with other values and what follows from them."""
    return access.change(tree, changes, value)


def _extra_laws(tree: Any) -> dict[str, tuple[str, ...]]:
    """Further words that the parameter `law` accepts."""
    name = outside.of(tree.own)
    return {LAW: (name,)} if name else {}


def _with_law(tree: Any, table: Mapping[str, object], where: str) -> Any:
    """The tree with the law that a table names."""
    refuse_part(tree, table, where)
    return under_law(with_correction(tree, table), table, where)


def with_correction(tree: Any, table: Mapping[str, object]) -> Any:
    """The tree with a set for the corrections that a table holds."""
    if is_corrected(tree) or not any(key.partition(".")[0] == CORRECTION for key in table):
        return tree
    kind = _Turned if place_of(tree).turns else Correction
    return tree._replace(correction=kind())


def is_corrected(tree: Any) -> bool:
    """Whether a calibration corrects a stage."""
    return isinstance(getattr(tree, CORRECTION, None), Correction)


class Switched(NamedTuple):
    """What of a correction can be changed live."""

    on: Annotated[
        int, Par("", "1: correct; 0: leave readings as they are", "choice", lo=0, hi=1)
    ] = 1


@cache
def _live(kind: Any) -> Any:
    return extended(kind, {CORRECTION: (Switched, Switched())}, next(iter(kind.__annotations__)))


def live_gains(tree: Any) -> Any:
    """The gains of a stage's law, and of a corrected stage whether it is corrected."""
    found = gains(tree)
    if not is_corrected(tree):
        return found
    kind: Any = type(found)
    return _live(kind)(Switched(tree.correction.on), *found)


def with_live_gains(tree: Any, found: Any) -> Any:
    """A stage's settings with other `live_gains`."""
    if not is_corrected(tree):
        return tree._replace(**{gains_set(tree): found})
    switched, *own = found
    changed = {gains_set(tree): type(gains(tree))(*own)}
    correction = tree.correction._replace(on=switched.on)
    return tree._replace(**changed, **{CORRECTION: correction})


@as_rotary
class _Turned(Correction):
    """Corrections of a stage that turns."""


def refuse_part(tree: Any, table: Mapping[str, object], where: str) -> None:
    """Raise for a friction part of a user's module, which axes no longer have."""
    rubbing = table.get("friction")
    named = PART in table or (isinstance(rubbing, Mapping) and "part" in rubbing)
    if named and not hasattr(getattr(tree, "friction", None), "part"):
        raise ProblemError(
            f"{where}, {PART}",
            "an axis has no friction parts of other modules",
            "Remove it, or write a stage of your own with that friction (docs/own-machines.md).",
        )


def under_law(tree: Any, table: Mapping[str, object], where: str) -> Any:
    """Settings with the gains of the law that a table names."""
    name = table.get(LAW)
    if not isinstance(name, str):
        return tree  # it is refused where the table is read
    return with_law(tree, name, f"{where}, {LAW}")


def with_law(tree: Tree, name: str, where: str) -> Tree:
    any_tree: Any = tree
    own = any_tree._field_defaults[LAW]
    if name == own or name in _extra_laws(any_tree).get(LAW, ()):
        return cast("Tree", any_tree._replace(law=name))
    if not outside.is_name(name):
        every = (own, *plugins.entry_points(outside.GROUP))
        raise InputError(where, printable(name), f"{nearest(name, every)}; or {outside.FORM}")
    law = outside.suitable_law(name, "", where)
    if law.unit != "m":
        problem = f"the law {printable(name)} is in {law.unit}"
        raise ProblemError(where, problem, "This machine needs a law in m.")
    return cast("Tree", any_tree._replace(law=name, own=law.gains()))


def is_own(tree: Any) -> bool:
    return bool(tree.law != tree._field_defaults[LAW])


def gains(tree: Any) -> Any:
    return getattr(tree, gains_set(tree))


def gains_set(tree: Any) -> str:
    """Name of the set of `gains`."""
    return OWN if is_own(tree) else "controller"


def derive_all(tree: Tree) -> Tree:
    """A tree with all derived values recomputed."""
    for path, rule in cast("Any", tree).derived():
        tree = replaced(tree, path, type(value_at(tree, path))(rule(tree)))
    return tree
