"""What the settings of every machine of one stage have beside their sets: a choice of the law and
its gains, what follows from other settings, what cannot work together, changes from Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar, cast

from macromicro.control import outside
from macromicro.control.stage_law import StageLaw
from macromicro.errors import InputError
from macromicro.machines import owned
from macromicro.schema import access
from macromicro.schema.keys import nearest
from macromicro.schema.par import Par, changed, extended, replaced, value_at
from macromicro.schema.text import printable

Tree = TypeVar("Tree")
Problem = tuple[str, Any, str]  # path, value, what is accepted and why
Checked = tuple[bool, str, Any, str]  # whether it is one, and the problem
Rule = tuple[str, Callable[[Any], Any]]

LAW, OWN = "law", "own"  # keys of a settings file: the law's name, and the gains of one's own


def machine_tree(
    law: StageLaw,
    rules: tuple[Rule, ...] = (),
    problems: Callable[[Any], list[Problem]] = lambda tree: [],
) -> Callable[[type[Tree]], type[Tree]]:
    """Decorator of the ``NamedTuple`` of a machine's settings.

    It adds the fields `law` and `own` (the gains of a law of another package, as `outside` finds
    it), and the methods that settings files ask a tree for.

    Parameters
    ----------
    law : StageLaw
        The machine's law, whose gains are the set `controller`.
    rules : tuple[Rule, ...], optional
        Pairs of a path and the rule that computes its value from the tree, unless it is set; none
        depends on a later one.
    problems : Callable[[Any], list[Problem]], optional
        From the tree to what cannot work together: path, value, and what is accepted and why.

    Returns
    -------
    Callable[[type[Tree]], type[Tree]]
        The decorator.
    """
    word = Par("", "control law, or MODULE:LAW of your own", "machine choice", choices=(law.name,))
    fields = {LAW: (Annotated[str, word], law.name), OWN: (Any, outside.NoGains())}

    def made(base: type[Tree]) -> type[Tree]:
        found: Any = extended(base, fields, next(iter(base.__annotations__)))
        found.derived = lambda tree: rules
        found.together = problems
        found.with_ = with_
        found.also = _also
        found.grown = _grown
        return cast("type[Tree]", found)

    return made


def with_(tree: Tree, changes: str | Mapping[str, object], value: object = None) -> Tree:
    """These settings with other values, and with what follows from them.

    Parameters
    ----------
    tree : Tree
        Settings of a machine.
    changes : str | Mapping[str, object]
        Path of a parameter; or several paths with their values.
    value : object, optional
        Of the one path: "2 kg", or a plain value where the parameter has no unit.

    Returns
    -------
    Tree
        A changed copy.

    Raises
    ------
    InputError
        As of a settings file.
    """
    return access.changed(tree, changes, value)


def _also(tree: Any) -> dict[str, tuple[str, ...]]:
    """Words that the parameter `law` takes beside its own."""
    name = outside.of(tree.own)
    return {LAW: (name,)} if name else {}


def _grown(tree: Any, table: Mapping[str, object], where: str) -> Any:
    """The tree with the parameters of the part, and the gains of the law, that a table names."""
    parts = owned.named(tree, table, where)
    return under_law(changed(tree, parts) if parts else tree, table, where)


def under_law(tree: Any, table: Mapping[str, object], where: str) -> Any:
    """Settings with the gains of the law that a table of settings names.

    Parameters
    ----------
    tree : Any
        Settings of a machine.
    table : Mapping[str, object]
        Of a file.
    where : str
        The file, for messages.

    Returns
    -------
    Any
        A copy.
    """
    name = table.get(LAW)
    if not isinstance(name, str):
        return tree  # it is refused where the table is read
    return joined(tree, name, f"{where}, {LAW}")


def joined(tree: Tree, name: str, where: str) -> Tree:
    """Settings under a law.

    Parameters
    ----------
    tree : Tree
        Settings of a machine.
    name : str
        The machine's own law, or one of another package, which joins with its default gains.
    where : str
        Option or file and key, for messages.

    Returns
    -------
    Tree
        A changed copy.

    Raises
    ------
    InputError
        There is no such law, or it counts in an encoder's counts.
    """
    any_tree: Any = tree
    own = any_tree._field_defaults[LAW]
    if name == own or name in _also(any_tree).get(LAW, ()):
        return cast("Tree", any_tree._replace(law=name))
    if not outside.is_name(name):
        accepted = f"{nearest(name, (own, *outside.offered()))}; or {outside.FORM}"
        raise InputError(where, printable(name), accepted)
    law = outside.find(name, where)
    if law.unit != "m":
        raise InputError(where, f"{printable(name)}, in {law.unit}", "a law in m on this machine")
    return cast("Tree", any_tree._replace(law=name, own=law.gains()))


def is_own(tree: Any) -> bool:
    """Whether settings choose a law of another package.

    Parameters
    ----------
    tree : Any
        Settings of a machine.

    Returns
    -------
    bool
        False for the machine's own law.
    """
    return bool(tree.law != tree._field_defaults[LAW])


def gains(tree: Any) -> Any:
    """The gains of the law that settings choose.

    Parameters
    ----------
    tree : Any
        Settings of a machine.

    Returns
    -------
    Any
        The set `own` under a law of another package, else `controller`.
    """
    return getattr(tree, gains_set(tree))


def gains_set(tree: Any) -> str:
    """The name of the set that `gains` gives.

    Parameters
    ----------
    tree : Any
        Settings of a machine.

    Returns
    -------
    str
        "controller" or "own".
    """
    return OWN if is_own(tree) else "controller"


def settled(tree: Tree) -> Tree:
    """A tree with all that is derived computed anew.

    Parameters
    ----------
    tree : Tree
        Settings with a method `derived`.

    Returns
    -------
    Tree
        A copy.
    """
    for path, rule in cast("Any", tree).derived():
        tree = replaced(tree, path, type(value_at(tree, path))(rule(tree)))
    return tree
