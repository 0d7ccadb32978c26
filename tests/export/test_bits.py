"""Every exported function and the kernel that it comes from give the same bits."""

from __future__ import annotations

import importlib
import math
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from macromicro import kernel
from macromicro.errors import InputError
from macromicro.export import catalogue, files, kinds
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Rows, Several, Struct
from macromicro.export.units import Entry, Unit
from tests.export.bound import Bound, arrays, bits, built, strict

BUILT = TemporaryDirectory(prefix="macromicro-")  # gone with this process
UNITS = tuple(catalogue.every())
RAISED = (ZeroDivisionError, OverflowError, ValueError, IndexError)


@cache
def alone() -> dict[str, Unit]:
    """Kernels that no unit brings along, by module: those that are exported by their own names."""
    package = Path(kernel.__file__).parent
    for file in package.rglob("*.py"):
        if re.search(r"^\s*@kernel$", file.read_text("utf-8"), re.MULTILINE):
            parts = file.relative_to(package.parent).with_suffix("").parts
            importlib.import_module(".".join(part for part in parts if part != "__init__"))
    brought = {made.source.function for name in UNITS for made in written_of(name).routines}
    entries: dict[str, list[Entry]] = {}
    for function in sorted(kernel.marked(), key=lambda it: (it.__module__, it.__qualname__)):
        name, module = function.__qualname__, function.__module__
        if function in brought or "<locals>" in name or not module.startswith("macromicro."):
            continue
        try:
            made = catalogue.alone(name, function)
            files.written(made)
        except InputError:
            continue
        entries.setdefault(module, []).append(made.entries[0]._replace(name=name.strip("_")))
    return {
        module: Unit(module.rpartition(".")[2], module, tuple(found), {})
        for module, found in entries.items()
    }


def unit_of(name: str) -> Unit:
    """A unit of the catalogue, or of `alone`."""
    return catalogue.unit(name) if name in UNITS else alone()[name]


@cache
def written_of(name: str) -> files.Written:
    """The code of a unit."""
    return files.written(unit_of(name))


@cache
def made(name: str, level: str = "-O1") -> Any:
    """A unit, its code, its library."""
    unit = unit_of(name)
    written = files.written(unit)
    folder = Path(mkdtemp(dir=BUILT.name))
    return unit, written, built(written, folder, level=level)


@cache
def functions() -> dict[str, tuple[str, int]]:
    """Every function once: its name, the first unit that has it, its place there."""
    found: dict[Any, tuple[str, str, int]] = {}
    for name in (*UNITS, *alone()):
        for place, routine in enumerate(written_of(name).routines):
            key = (routine.source.function.__module__, routine.source.function.__qualname__)
            found.setdefault((*key, len(str(routine.parameters)) if key[1] == "step" else 0),
                             (f"{name}: {routine.name}", name, place))  # fmt: skip
    return {shown: (unit, place) for shown, unit, place in found.values()}


def within(rounded: Callable[[float], int]) -> Callable[[float], int]:
    """A function to whole numbers that refuses those beyond C's, which Python alone has."""

    def checked(x: float) -> int:
        found = rounded(x)
        if abs(found) > 2**62:
            raise OverflowError("beyond 64 bits")
        return found

    return checked


def near(value: float) -> st.SearchStrategy[float]:
    """Floats about an example, and those that need care."""
    size = value if math.isfinite(value) else 1.0
    about = st.floats(0.01, 2.0).map(lambda k: k * size)
    other = st.floats(0.01, 1e3).flatmap(lambda x: st.sampled_from([x, -x]))
    special = st.sampled_from(SPECIAL)
    return st.one_of(st.just(value), about, about, other, special)


MANY = 30  # numbers: more of them hypothesis draws too slowly one by one
SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, math.nan, math.inf, -math.inf)


def numbers(kind: Any) -> int:
    """How many numbers a value holds."""
    return sum(map(numbers, kind.types)) if isinstance(kind, Struct | Several) else 1


def tabled(kind: Any) -> bool:
    """Whether its numbers say what is in a table: others make searches in it endless."""
    return isinstance(kind, Struct) and any(isinstance(part, Rows) for part in kind.types)


def drawn(kind: Any, value: Any, random: Random) -> Any:
    """A value about an example: about each number in its place, some special ones among them."""
    if isinstance(kind, Rows) or tabled(kind):
        return value
    if isinstance(kind, Struct | Several):
        parts = [drawn(k, v, random) for k, v in zip(kind.types, value, strict=True)]
        return kind.instance_class(*parts) if isinstance(kind, Struct) else tuple(parts)
    lucky = random.random()
    if kind in (WHOLE, TRUTH):
        other = lucky < 0.5 if kind is TRUTH else random.randint(-1, 7)
        return other if kind is TRUTH or lucky > 0.9 else value
    special = random.choice(SPECIAL) if lucky > 0.98 else value
    return special if lucky > 0.98 or lucky < 0.3 else value * random.uniform(0.01, 2.0)


def like(kind: Any, example: Any) -> st.SearchStrategy[Any]:  # noqa: PLR0911
    """Values of a type about an example."""
    if numbers(kind) > MANY and example is not None:
        return st.integers(0, 2**32).map(lambda seed: drawn(kind, example, Random(seed)))
    if kind is REAL:
        return near(0.0 if example is None else float(example))
    if example is not None and (isinstance(kind, Rows) or tabled(kind)):
        return st.just(example)
    if kind in (WHOLE, TRUTH):
        whole = st.one_of(st.just(int(example or 0)), st.integers(-1, 7))
        return whole if kind is WHOLE else st.booleans()
    if isinstance(kind, Rows):
        shape = tuple(n or 2 for n in kind.shape)
        return st.integers(0, 2**32).map(
            lambda seed: np.random.default_rng(seed).standard_normal(shape)
        )
    parts = [
        like(part, None if example is None else example[place])
        for place, part in enumerate(kind.types)
    ]
    if isinstance(kind, Several):
        return st.tuples(*parts)
    assert isinstance(kind, Struct)
    return st.tuples(*parts).map(lambda found: kind.instance_class(*found))


def examples(unit: Any) -> dict[Any, Any]:
    """Values that a unit brings, by their types."""
    found: dict[Any, Any] = {}

    def note(value: Any) -> None:
        if isinstance(value, tuple):
            try:
                found.setdefault(files.kind_of(value), value)
            except kinds.Unlike:
                return
            for each in value:
                note(each)

    for value in (
        *unit.given.values(),
        unit.state,
        *(a for e in unit.entries for a in e.arguments),
    ):
        note(value)
    return found


@pytest.mark.parametrize("function", functions())
def test_a_function_in_c_gives_the_bits_of_its_kernel(
    function: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, place = functions()[function]
    unit, written, library = made(name)
    routine = written.routines[place]
    known = examples(unit)
    bound = Bound(written.program)
    given_ = {n: like(k, known.get(k)) for n, k in routine.parameters.items()}
    tried = 0
    for rounded in ("floor", "ceil"):
        monkeypatch.setattr(math, rounded, within(getattr(math, rounded)))

    @settings(
        max_examples=12, deadline=None, derandomize=True, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(st.fixed_dictionaries(given_))
    def same(values: dict[str, Any]) -> None:
        nonlocal tried
        before = {n: strict(values[n]) for n in routine.parameters}
        mine = {n: strict(values[n]) for n in routine.parameters}
        try:
            with np.errstate(all="ignore"):
                expected = routine.source.function(*mine.values())
        except RAISED:
            assume(False)
        found = bound.call(library, routine, before)
        bound.alive.clear()
        tried += 1
        assert bits(found) == bits(expected)
        for a, b in zip(arrays(tuple(mine.values())), arrays(tuple(before.values())), strict=True):
            assert np.array_equal(a, b, equal_nan=True)

    same()
    assert tried >= 1


def test_kernels_without_a_unit_are_among_them() -> None:
    assert len(alone()) > 10
    assert len(functions()) > 250
