"""What an expression of a kernel is in C."""

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
    """An expression in C.

    Attributes
    ----------
    kind : Kind
        Its type.
    text : str
        In C.
    level : int
        How tightly its outermost operator binds.
    form : str
        A value, a place in memory, or a pointer to one.
    value : Any
        What it is, if that is known here: a whole number or a truth value.
    items : tuple[Expr, ...] | None
        Parts of a tuple that is written out.
    layout : Any
        Of a plain tuple: the routine whose result it is; None for the tuple itself.
    stable : bool
        Whether the place that it names never changes.
    """

    kind: Any
    text: str
    level: int = LITERAL
    form: str = VALUE
    value: Any = None
    items: tuple[Any, ...] | None = None
    layout: Any = None
    stable: bool = False

    def within(self, level: int) -> str:
        """The text as an operand of what binds at `level`."""
        return self.text if self.level >= level else f"({self.text})"
