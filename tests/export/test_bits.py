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

from macromicro import kernel
from macromicro.errors import InputError
from macromicro.export import catalogue, files, kinds
from macromicro.export.kinds import TRUTH, WHOLE, Rows, Several, Struct
from macromicro.export.units import Entry, Unit
from tests.export.bound import Bound, arrays, bits, built, strict

BUILT = TemporaryDirectory(prefix="macromicro-")  # gone with this process
UNITS = tuple(catalogue.every())
PARTS = 16  # of all functions, which take seconds to find: too long for the collection of tests
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
            files.write_unit(made)
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
    return files.write_unit(unit_of(name))


@cache
def made(name: str, level: str = "-O1") -> Any:
    """A unit, its code, its library."""
    unit = unit_of(name)
    written = files.write_unit(unit)
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


MANY = 30  # numbers: of more of them, few are special, or the kernel ends at its first test
SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, math.nan, math.inf, -math.inf)


def numbers(kind: Any) -> int:
    """How many numbers a value holds."""
    return sum(map(numbers, kind.types)) if isinstance(kind, Struct | Several) else 1


def tabled(kind: Any) -> bool:
    """Whether its numbers say what is in a table: others make searches in it endless."""
    return isinstance(kind, Struct) and any(isinstance(part, Rows) for part in kind.types)


def drawn(kind: Any, value: Any, random: Random, odd: float) -> Any:  # noqa: PLR0911
    """A value of a type about an example, if there is one; a share `odd` of its numbers far off."""
    if value is not None and (isinstance(kind, Rows) or tabled(kind)):
        return value
    if isinstance(kind, Rows):
        shape = tuple(n or 2 for n in kind.shape)
        return np.random.default_rng(random.getrandbits(32)).standard_normal(shape)
    if isinstance(kind, Struct | Several):
        values = [None] * len(kind) if value is None else value
        parts = [drawn(k, v, random, odd) for k, v in zip(kind.types, values, strict=True)]
        return kind.instance_class(*parts) if isinstance(kind, Struct) else tuple(parts)
    off = random.random() < odd
    if kind is TRUTH:
        return random.random() < 0.5
    if kind is WHOLE:
        return random.randint(-1, 7) if off else int(value or 0)
    if off:
        far = random.choice((1.0, -1.0)) * random.uniform(0.01, 1e3)
        return random.choice((far, random.choice(SPECIAL)))
    about = random.uniform(-2.0, 2.0) if value is None or not math.isfinite(value) else value
    return random.choice((about, about * random.uniform(0.01, 2.0)))


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


@pytest.mark.parametrize("part", range(PARTS))
def test_functions_in_c_give_the_bits_of_their_kernels(part: int) -> None:
    for function in list(functions())[part::PARTS]:
        with pytest.MonkeyPatch.context() as patch:
            compared(function, patch)


def compared(function: str, patch: pytest.MonkeyPatch) -> None:
    """Twenty calls of a function in C with those of its kernel."""
    name, place = functions()[function]
    unit, written, library = made(name)
    routine = written.routines[place]
    known = examples(unit)
    bound = Bound(written.program)
    odd = 0.3 if sum(map(numbers, routine.parameters.values())) < MANY else 0.02
    for rounded in ("floor", "ceil"):
        patch.setattr(math, rounded, within(getattr(math, rounded)))
    random, tried = Random(1), 0
    for _ in range(200):
        values = {n: drawn(k, known.get(k), random, odd) for n, k in routine.parameters.items()}
        before = {n: strict(values[n]) for n in routine.parameters}
        mine = {n: strict(values[n]) for n in routine.parameters}
        try:
            with np.errstate(all="ignore"):
                expected = routine.source.function(*mine.values())
        except RAISED:
            continue
        found = bound.call(library, routine, before)
        bound.alive.clear()
        assert bits(found) == bits(expected), function
        for a, b in zip(arrays(tuple(mine.values())), arrays(tuple(before.values())), strict=True):
            assert np.array_equal(a, b, equal_nan=True), function
        tried += 1
        if tried == 20:
            return
    assert tried, function


def test_kernels_without_a_unit_are_among_them() -> None:
    assert len(alone()) > 10
    assert len(functions()) > 250
