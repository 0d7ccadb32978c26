"""The settings of several stages in one tree: the tree of each stage under its name."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from macromicro.machines.tree import (
    Checked,
    Problem,
    Rule,
    derive_all,
    refuse_part,
    under_law,
    with_,
    with_correction,
)


def joint_tree(stages: Mapping[str, Any]) -> Any:
    """A tree of stages by name, on the shortest of their periods, with derived values filled in."""
    names = tuple(stages)
    tree: Any = type("Stages", (namedtuple("Stages", names),), {"__slots__": ()})
    tree.__annotations__ = dict.fromkeys(names, Any)
    shortest = min(own.timing.period for own in stages.values())
    rules = each_rule(stages)

    def problems(tree: Any) -> list[Problem]:
        found = on_one_clock(tree, names)
        return [(path, value, words) for wrong, path, value, words in found if wrong]

    tree.derived = lambda tree: rules
    tree.together = problems
    tree.grown = lambda tree, table, where: with_gains(tree, names, table, where)
    tree.with_ = with_
    clocked = {
        name: own._replace(timing=own.timing._replace(period=shortest))
        for name, own in stages.items()
    }
    return derive_all(tree(**clocked))


def each_rule(stages: Mapping[str, Any]) -> tuple[Rule, ...]:
    """The rules of each stage within the whole tree."""
    return tuple(
        (f"{name}.{path}", _within(name, rule))
        for name, own in stages.items()
        for path, rule in own.derived()
    )


def _within(name: str, rule: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda tree: rule(getattr(tree, name))


def on_one_clock(tree: Any, names: Sequence[str]) -> Iterator[Checked]:
    """Whether all stages have the period of the first."""
    first = names[0]
    whose = all_of(len(names))
    for name in names[1:]:
        period = getattr(tree, name).timing.period
        wrong = period != getattr(tree, first).timing.period
        words = f"{{{first}.timing.period}}: {whose} run on one clock"
        yield wrong, f"{name}.timing.period", period, words


def all_of(count: int) -> str:
    """All stages of a machine, in words."""
    return "both axes" if count == 2 else "all stages"


def with_gains(tree: Any, names: Sequence[str], table: Mapping[str, object], where: str) -> Any:
    """A tree with the gains that a table names."""
    laws: dict[str, Any] = {}
    for name in names:
        own, there, one = table.get(name), f"{where}, {name}", getattr(tree, name)
        told = dict(own) if isinstance(own, Mapping) else {}
        told |= {
            k.removeprefix(f"{name}."): v for k, v in table.items() if k.startswith(f"{name}.")
        }
        laws[name] = under_law(with_correction(one, told), told, there)
        refuse_part(one, told, there)
    return tree._replace(**laws)
