"""The types of the kernels' language: numbers, ``NamedTuple``s of them, arrays of fixed size."""

from __future__ import annotations

import inspect
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np


@dataclass(frozen=True)
class Scalar:
    """A number: real, integer, or boolean."""

    name: str

    def __str__(self) -> str:
        return self.name


REAL, WHOLE, TRUTH = Scalar("float"), Scalar("int"), Scalar("bool")


@dataclass(frozen=True)
class Struct:
    """A ``NamedTuple``, with the attribute names of numba's types, for `by_type`."""

    instance_class: Any
    types: tuple[Any, ...]

    @property
    def fields(self) -> tuple[str, ...]:
        found: tuple[str, ...] = self.instance_class._fields
        return found

    def part(self, name: str) -> Any:
        return self.types[self.fields.index(name)]

    def __len__(self) -> int:
        return len(self.types)

    def __str__(self) -> str:
        return str(self.instance_class.__name__)


@dataclass(frozen=True)
class Several:
    types: tuple[Any, ...]

    def __len__(self) -> int:
        return len(self.types)

    def __getitem__(self, index: int) -> Any:
        return self.types[index]

    def __str__(self) -> str:
        return f"({', '.join(map(str, self.types))})"


@dataclass(frozen=True)
class Rows:
    """An array; None: a length that only the caller knows."""

    element: Scalar
    shape: tuple[int | None, ...]

    def __str__(self) -> str:
        return f"array of {self.element}, shape {self.shape}"


Kind = Scalar | Struct | Several | Rows


class Unlike(Exception):
    """A value without a type of this language; the text describes it."""


def empty(kind: Any) -> bool:
    """Whether a value of this type holds nothing, such as the gains of no law."""
    return isinstance(kind, Struct | Several) and all(empty(part) for part in kind.types)


def of_value(value: Any, hint: Any = None) -> Kind:
    """The type of an example; an int annotated as float is a float. Raises `Unlike`."""
    if isinstance(value, bool | np.bool_):
        return TRUTH
    if isinstance(value, int | np.integer):
        return REAL if hint is float else WHOLE
    if isinstance(value, float | np.floating):
        return REAL
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in "fi":
            raise Unlike(f"an array of {value.dtype}")
        return Rows(REAL if value.dtype.kind == "f" else WHOLE, value.shape)
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        hints = hints_of(type(value))
        pairs = zip(value._fields, value, strict=True)
        return Struct(type(value), tuple(of_value(v, hints.get(n)) for n, v in pairs))
    if isinstance(value, tuple):
        return Several(tuple(of_value(each) for each in value))
    raise Unlike(f"a value of type {type(value).__name__}")


def of_hint(hint: Any) -> Kind:
    """The type of an annotation; `Unlike` for an incomplete one, such as an array without size."""
    if hint in (float, int, bool):
        return {float: REAL, int: WHOLE, bool: TRUTH}[hint]
    if get_origin(hint) in (Union, types.UnionType):
        return of_hint(get_args(hint)[0])
    if get_origin(hint) is tuple and Ellipsis not in get_args(hint):
        return Several(tuple(of_hint(part) for part in get_args(hint)))
    if isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields"):
        hints = hints_of(hint)
        return Struct(hint, tuple(of_hint(hints[name]) for name in hint._fields))
    if get_origin(hint) is tuple:
        raise Unlike("a tuple whose annotation gives no length")
    if get_origin(hint) is np.ndarray:
        raise Unlike("an array whose annotation gives no size")
    raise Unlike(f"annotated {getattr(hint, '__name__', hint)}")


def hints_of(kind: Any, noted: bool = False) -> dict[str, Any]:
    """Resolved annotations of a class or function; none where that fails."""
    try:
        return get_type_hints(kind, include_extras=noted)
    except (NameError, TypeError):
        return {}


def widen(made: Callable[..., Any], found: Sequence[Kind]) -> tuple[Kind, ...]:
    """Types of arguments or fields, where an int that is annotated as a float is a float."""
    hints = hints_of(made)
    return tuple(
        REAL if hints.get(name) is float and kind in (WHOLE, TRUTH) else kind
        for name, kind in zip(inspect.signature(made).parameters, found, strict=True)
    )


def join(one: Any, other: Any) -> Any:
    """The type that holds values of both; None if there is none."""
    if one == other:
        return one
    if {one, other} == {REAL, WHOLE}:
        return REAL
    if {one, other} == {WHOLE, TRUTH}:
        return WHOLE
    same = isinstance(one, Struct | Several) and type(one) is type(other)
    if same and len(one) == len(other):
        parts = tuple(join(a, b) for a, b in zip(one.types, other.types, strict=True))
        if None not in parts:
            if isinstance(one, Several):
                return Several(parts)
            if one.instance_class is other.instance_class:
                return Struct(one.instance_class, parts)
    return None
