"""Parameter sets: listed in order with their paths, changed one at a time."""

import math
from functools import reduce
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.schema.par import ASSUMED, Entry, Par, entries, finite, is_set, replaced


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


@pytest.mark.parametrize("value", [0, -3, 1.5, np.float64(2.0), 10**300])
def test_plain_numbers(value: Any) -> None:
    assert finite(value)


@pytest.mark.parametrize("value", [
    math.nan, math.inf, -math.inf, 10**400, True, None, "1", 1j, [1.0], np.array(1.0),
    np.array([1.0]), np.float32(1.0), np.float64(math.nan),
])  # fmt: skip
def test_anything_else(value: Any) -> None:
    assert not finite(value)


VOLTS = Par("V", "a voltage", positive=True, hi=3.0)
SPEED = Par("m/s", "a speed", shown="mm/s", lo=-0.1, hi=0.2)
LAW = Par("", "a law", choices=("pd", "pid"))


@pytest.mark.parametrize(
    ("par", "default", "words"),
    [
        (VOLTS, 1.0, "above zero and at most 3 V"),
        (SPEED, 0.0, "from -100 mm/s to 200 mm/s"),
        (Par("N", "a force", lo=0.0), 1.0, "0 N or more"),
        (Par("N", "a force", hi=4.0), 1.0, "at most 4 N"),
        (Par("N", "a force", positive=True), 1.0, "above zero"),
        (Par("N", "a force", positive=True, lo=0.5), 1.0, "0.5 N or more"),
        (Par("N", "a force"), 1.0, "a finite number"),
        (Par("", "a priority", lo=1, hi=90), 3, "a whole number from 1 to 90"),
        (Par("", "a number"), 3, "a whole number"),
        (LAW, "pd", "'pd' or 'pid'"),
        (Par("", "a name"), "x", "text of at most 100 characters"),
        (Par("", "a switch"), True, "true or false"),
    ],
)
def test_what_is_accepted_stands_in_words(par: Par, default: Any, words: str) -> None:
    assert Entry("a.b", par, default).accepted == words


@pytest.mark.parametrize(
    ("par", "default", "good", "bad"),
    [
        (VOLTS, 1.0, (1e-9, 3.0, 2), (0.0, -1.0, 3.001, math.nan, math.inf, True, "1", None)),
        (SPEED, 0.0, (-0.1, 0.2, 0), (-0.1001, 0.2001, 10**400)),
        (Par("", "whole", lo=1, hi=9), 3, (1, 9, 4.0), (0, 10, 4.5, "4", False)),
        (LAW, "pd", ("pd", "pid"), ("PD", "", 3, ["pd"])),
        (Par("", "a name"), "x", ("", "a" * 100), ("a" * 101, "a\nb", 5)),
        (Par("", "a switch"), True, (True, False), (1, 0, "true")),
    ],
)
def test_a_value_is_taken_as_the_parameters_type_or_refused(
    par: Par, default: Any, good: tuple[Any, ...], bad: tuple[Any, ...]
) -> None:
    entry = Entry("a.b", par, default)
    for value in good:
        taken = entry.check(value, "here")
        assert taken == value and type(taken) is type(default)
    for value in bad:
        with pytest.raises(InputError) as caught:
            entry.check(value, "here")
        assert caught.value.where == "here" and caught.value.accepted == entry.accepted


@given(st.lists(st.floats(allow_nan=True), min_size=1, max_size=20))
def test_many_values_are_judged_as_one_is(values: list[float]) -> None:
    entry = Entry("a.b", SPEED, 0.0)
    for value, good in zip(values, entry.admits(np.array(values)), strict=True):
        try:
            entry.check(value, "here")
        except InputError:
            assert not good
        else:
            assert good


@pytest.mark.parametrize(
    ("par", "default", "raw", "value"),
    [
        (SPEED, 0.0, "50 mm/s", 0.05),
        (VOLTS, 1.0, "1500 mV", 1.5),
        (Par("", "n", lo=0), 3, 2**60 + 1, 2**60 + 1),  # no float on the way
        (Par("", "n"), 3, "4", 4),
        (LAW, "pd", "pid", "pid"),
        (Par("", "on"), False, True, True),
        (Par("K", "knots"), (1.0, 2.0), ["3 K", "4 K", "5 K"], (3.0, 4.0, 5.0)),
    ],
)
def test_text_with_a_unit_is_read(par: Par, default: Any, raw: Any, value: Any) -> None:
    assert Entry("a.b", par, default).read(raw, "here") == value


@pytest.mark.parametrize(
    ("par", "default", "raw", "where"),
    [
        (SPEED, 0.0, "300 mm/s", "here"),
        (SPEED, 0.0, "50 mm", "here"),
        (SPEED, 0.0, True, "here"),
        (SPEED, 0.0, [1], "here"),
        (Par("", "n"), 3, "4.5", "here"),
        (Par("K", "knots"), (1.0, 2.0), ["3 K"], "here"),
        (Par("K", "knots"), (1.0, 2.0), ["3 K", "4"], "here, item 2"),
    ],
)
def test_what_cannot_be_read_is_refused(par: Par, default: Any, raw: Any, where: str) -> None:
    with pytest.raises(InputError) as caught:
        Entry("a.b", par, default).read(raw, "here")
    assert caught.value.where == where


STEEP = Par("V/m", "gain", shown="V/mm", lo=0.0, hi=1e6)


@given(st.integers(-(10**15) + 1, 10**15 - 1), st.integers(-12, 6))
def test_what_a_client_writes_is_what_it_reads(digits: int, exponent: int) -> None:
    """To fifteen digits, which is all that a float holds of any decimal."""
    value = float(f"{digits}e{exponent}")
    assert STEEP.given(STEEP.taken(value)) == value


def test_numbers_for_clients_are_in_the_unit_that_they_read() -> None:
    assert (STEEP.read_in, STEEP.given(3200.0), STEEP.taken(3.2)) == ("V/mm", 3.2, 3200.0)
    plain = Par("s", "wait")
    assert (plain.read_in, plain.given(2), plain.taken(2.5)) == ("s", 2, 2.5)
    for other in (math.inf, "pd-tuned", True):
        assert STEEP.given(other) is other and STEEP.taken(other) is other
    assert STEEP.taken(1e308) == math.inf


@pytest.mark.parametrize("raw", [3.2, "3.2", "3.2 V", "3.2 V/um/s"])
def test_a_missing_or_wrong_unit_is_told_with_the_one_that_is_read(raw: object) -> None:
    with pytest.raises(InputError, match=r"a finite number and its unit: V/mm$"):
        Entry("kp", STEEP, 3000.0).read(raw, "x.toml, kp")
    assert Entry("kp", STEEP, 3000.0).read("3.2 V/mm", "x.toml, kp") == 3200.0
