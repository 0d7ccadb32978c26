"""Parameter sets: listed in order with their paths, changed one at a time."""

import math
from functools import reduce
from typing import Annotated, Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.parameters import ASSUMED, Par, entries, is_set, replaced


class Friction(NamedTuple):
    """Friction of a toy."""

    coulomb: Annotated[float, Par("N", "kinetic level", "Section 4.2", lo=0.0)] = 11.0
    model: Annotated[str, Par("", "friction law", choices=("stribeck", "lugre"))] = "lugre"


class Table(NamedTuple):
    """A parameter that is itself a list, and one that nobody describes."""

    heat: Annotated[tuple[float, ...], Par("K", "heat at the knots")] = (0.0, 22.5, 81.5)
    secret: float = 1.0


class Bench(NamedTuple):
    """A toy bench."""

    mass: Annotated[float, Par("kg", "moving mass", positive=True)] = 0.8
    friction: Friction = Friction()
    table: Table = Table()
    slots: Annotated[int, Par("1", "teeth")] = 7


class Everything(NamedTuple):
    """The tree above a tree."""

    bench: Bench = Bench()
    seed: Annotated[int, Par("1", "seed of the noise")] = 0


PATHS = [
    "bench.mass",
    "bench.friction.coulomb",
    "bench.friction.model",
    "bench.table.heat",
    "bench.slots",
    "seed",
]
paths = st.sampled_from(PATHS)


def at(tree: Any, path: str) -> Any:
    """The value at a dotted path."""
    return reduce(getattr, path.split("."), tree)


def test_entries_are_complete_and_in_order() -> None:
    found = list(entries(Everything()))
    assert [entry.path for entry in found] == PATHS
    assert [entry.value for entry in found] == [0.8, 11.0, "lugre", (0.0, 22.5, 81.5), 7, 0]


def test_entries_of_a_branch_can_carry_the_path_of_its_root() -> None:
    found = [entry.path for entry in entries(Friction(), "bench.friction.")]
    assert found == PATHS[1:3]


def test_an_entry_describes_its_parameter() -> None:
    par = {entry.path: entry.par for entry in entries(Everything())}
    coulomb = par["bench.friction.coulomb"]
    assert coulomb == Par("N", "kinetic level", "Section 4.2", lo=0.0)
    assert par["bench.friction.model"].choices == ("stribeck", "lugre")
    assert par["bench.mass"].positive


def test_a_bare_description_claims_no_source_and_sets_no_bound() -> None:
    par = Par("kg", "moving mass")
    assert par.source == ASSUMED
    assert (par.lo, par.hi, par.positive) == (-math.inf, math.inf, False)


@given(path=paths, value=st.floats(allow_nan=False))
def test_replaced_changes_the_one_parameter_and_no_other(path: str, value: float) -> None:
    tree = Everything()
    before = {entry.path: entry.value for entry in entries(tree)}
    changed = replaced(tree, path, value)
    assert at(changed, path) == value
    assert {entry.path: entry.value for entry in entries(changed)} == before | {path: value}
    assert tree == Everything()


@given(path=paths)
def test_replacing_a_value_by_itself_changes_nothing(path: str) -> None:
    tree = Everything()
    assert replaced(tree, path, at(tree, path)) == tree


@given(path=paths, first=st.floats(), second=st.floats(allow_nan=False))
def test_the_last_replacement_counts(path: str, first: float, second: float) -> None:
    tree = Everything()
    twice = replaced(replaced(tree, path, first), path, second)
    assert twice == replaced(tree, path, second)


def test_replaced_keeps_the_types_of_the_sets() -> None:
    changed = replaced(Everything(), "bench.friction.coulomb", 9.0)
    assert isinstance(changed, Everything)
    assert isinstance(changed.bench, Bench)
    assert isinstance(changed.bench.friction, Friction)


def test_replaced_can_exchange_a_whole_branch() -> None:
    branch = Friction(coulomb=5.0, model="stribeck")
    assert replaced(Everything(), "bench.friction", branch).bench.friction is branch


@pytest.mark.parametrize("path", ["mass", "bench.weight", "bench.friction.x", "wagon.mass", ""])
def test_replaced_refuses_an_unknown_path(path: str) -> None:
    with pytest.raises((AttributeError, ValueError, TypeError)):
        replaced(Everything(), path, 1.0)


def test_only_named_tuples_are_sets() -> None:
    assert is_set(Friction())
    assert not any(map(is_set, [(1.0, 2.0), 1.0, "lugre", None, Friction]))
