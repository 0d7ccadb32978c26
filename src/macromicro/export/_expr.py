"""An expression of a kernel in C."""

from __future__ import annotations

from typing import Any, NamedTuple

# How tightly C's operators bind.
LITERAL, PREFIX, TIMES, PLUS, LESS, EQUAL, AND, OR, CHOICE = 16, 15, 13, 12, 10, 9, 5, 4, 3
VALUE, PLACE, POINTER = "value", "place", "pointer"

LANGUAGE = (
    "the language of kernels (CONTRIBUTING.md): floats, ints, bools, NamedTuples, arrays of fixed "
    "size, if, for over range, while, math, other kernels"
)


class Expr(NamedTuple):
    kind: Any  # its type
    text: str  # in C
    level: int = LITERAL  # how tightly its outermost operator binds
    form: str = VALUE  # A value, a place in memory, or a pointer to one
    value: Any = None  # what it is, if that is known here: a whole number or a truth value
    items: tuple[Any, ...] | None = None  # parts of a tuple that is written out
    # of a plain tuple: the routine whose result it is; None for the tuple itself
    layout: Any = None
    stable: bool = False  # whether the place that it names never changes

    def within(self, level: int) -> str:
        """The text as an operand of an operator that binds at `level`."""
        return self.text if self.level >= level else f"({self.text})"
