"""Expressions of a kernel in C: names, fields and constants."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from macromicro.export import kinds
from macromicro.export._sources import Source, Unknown
from macromicro.export._text import legal
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty

if TYPE_CHECKING:
    from macromicro.export._program import Program

LANGUAGE = (
    "the language of kernels (CONTRIBUTING.md): floats, ints, bools, NamedTuples, arrays of fixed "
    "size, if, for over range, while, math, other kernels"
)


class Level:
    """How tightly C's operators bind."""

    LITERAL, PREFIX, TIMES, PLUS, LESS, EQUAL, AND, OR, CHOICE = 16, 15, 13, 12, 10, 9, 5, 4, 3


class Expr(NamedTuple):
    kind: Any  # its type
    text: str  # in C
    level: int = Level.LITERAL  # how tightly its outermost operator binds
    place: bool = False  # whether it is a place in memory, "(*p)" where a pointer leads
    value: Any = None  # what it is, if that is known here: a whole number or a truth value
    items: tuple[Any, ...] | None = None  # parts of a tuple that is written out
    layout: Any = None  # the routine whose result it is
    stable: bool = False  # whether the place that it names never changes

    def within(self, level: int) -> str:
        """The text as an operand of an operator that binds at `level`."""
        return self.text if self.level >= level else f"({self.text})"

    def member(self, name: str) -> str:
        """A member of the struct that it is."""
        if self.text.startswith("(*"):
            return f"{self.text[2:-1]}->{name}"
        return f"{self.within(Level.LITERAL)}.{name}"


class Reading:
    """Reader of the expressions of one kernel."""

    def __init__(self, program: Program, source: Source) -> None:
        self.program = program
        self.source = source
        self.local: set[str] = set()
        self.kinds: dict[str, Kind] = {}
        self.named: dict[str, str] = {}
        self.steady: set[str] = set()
        self.before: list[str] = []  # lines that the present statement needs before it
        self.taken: set[str] = set()
        self.depends = 0  # above 0: what is read may never be computed
        self.statement: ast.AST = source.node  # the present one
        self.mutates = False  # whether it writes into any array
        self.called, self.changing = 0, False  # kernels that the present statement calls
        self.written: set[str] = set()  # parameters whose arrays are written into

    def refuse(self, node: ast.AST, found: str, accepted: str = LANGUAGE) -> NoReturn:
        self.source.refuse(node, found, accepted)

    @contextmanager
    def perhaps(self) -> Iterator[None]:
        """Mark expressions that are evaluated under a condition."""
        self.depends += 1
        try:
            yield
        finally:
            self.depends -= 1

    def read(self, node: ast.AST) -> Expr:
        try:
            return self.constant(node, self.source.constant(node, self.local))
        except Unknown:
            pass
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            self.refuse(node, ast.unparse(node))
        found: Expr = method(node)
        return found

    def constant(self, node: ast.AST, value: Any) -> Expr:
        named = isinstance(node, ast.Name | ast.Attribute)
        if isinstance(value, bool | int | float):
            kind = kinds.of_value(value)
            exact = value if kind is not REAL else None
            if named and not isinstance(value, bool) and math.isfinite(value):
                name = ast.unparse(node).rpartition(".")[2]
                text = self.program.constant(name, self.source.home(node), value)
                return Expr(kind, text, value=exact)
            text = self.program.number(value)
            level = Level.PREFIX if text.startswith("-") else Level.LITERAL
            return Expr(kind, text, level, value=exact)
        if isinstance(value, tuple):
            try:
                kind = kinds.of_value(value)
            except kinds.Unlike as error:
                self.refuse(node, f"{ast.unparse(node)}, {error}")
            return Expr(kind, self.program.literal(value, kind))
        return self.refuse(node, ast.unparse(node))

    # Names, fields, items

    def _name(self, node: ast.Name) -> Expr:
        if node.id not in self.kinds:
            self.refuse(node, node.id, "a variable that has a value here, or a constant")
        kind, text = self.kinds[node.id], self.named[node.id]
        return Expr(kind, text, place=True, stable=node.id in self.steady)

    def _attribute(self, node: ast.Attribute) -> Expr:
        if node.attr == "shape":
            rows = self.read(node.value)
            if isinstance(rows.kind, Rows):
                items = tuple(self._length(node, n) for n in rows.kind.shape)
                return Expr(Several((WHOLE,) * len(items)), "", items=items)
        base = self.read(node.value)
        if not isinstance(base.kind, Struct) or node.attr not in base.kind.fields:
            self.refuse(node, f"{ast.unparse(node)} of {base.kind}", f"a field of it; {LANGUAGE}")
        return self.field(base, node.attr)

    def field(self, base: Expr, name: str) -> Expr:
        if base.items is not None:
            found: Expr = base.items[base.kind.fields.index(name)]
            return found
        kind = base.kind.part(name)
        return Expr(kind, base.member(legal(name)), place=base.place, stable=base.stable)

    def items(self, whole: Expr, name: str = "pair") -> tuple[Expr, ...]:
        if whole.items is not None:
            return whole.items
        if isinstance(whole.kind, Struct):
            return tuple(self.field(whole, each) for each in whole.kind.fields)
        if empty(whole.kind):
            return tuple(Expr(kind, "", items=()) for kind in whole.kind.types)
        base = whole if whole.place else self.kept(whole, name)
        names = self.program.parts(whole.kind, whole.layout)
        return tuple(
            Expr(kind, base.member(n), place=True, stable=base.stable)
            for n, kind in zip(names, whole.kind.types, strict=True)
        )

    def kept(self, found: Expr, name: str) -> Expr:
        """A value stored in a variable before the present statement."""
        if self.depends:
            accepted = "a separate statement before it, as this part is not always evaluated"
            self.refuse(self.statement, found.text, accepted)
        free = self.fresh(name)
        declared = self.program.declared(found.kind, free, layout=found.layout)
        self.before.append(f"const {declared} = {found.text};")
        return found._replace(text=free, place=True, level=Level.LITERAL, stable=True)

    def fresh(self, name: str) -> str:
        free, number = name, 2
        while free in self.taken or free in self.named.values():
            free, number = f"{name}_{number}", number + 1
        self.taken.add(free)
        return free

    def _length(self, node: ast.AST, number: int | None) -> Expr:
        if number is None:
            self.refuse(node, "the length of an array without a fixed size")
        return Expr(WHOLE, str(number), value=number)

    def _subscript(self, node: ast.Subscript) -> Expr:
        base = self.read(node.value)
        if isinstance(base.kind, Rows):
            return self._element(node, base)
        if not isinstance(base.kind, Several | Struct):
            self.refuse(node, ast.unparse(node))
        items = self.items(base)
        if isinstance(node.slice, ast.Slice):
            bounds = [self._whole(each) for each in (node.slice.lower, node.slice.upper)]
            chosen = items[bounds[0] : bounds[1]]
            return Expr(Several(tuple(each.kind for each in chosen)), "", items=chosen)
        index = self._whole(node.slice)
        if index is None or not -len(items) <= index < len(items):
            accepted = f"a constant below {len(items)}, as its parts differ in type"
            self.refuse(node, ast.unparse(node), accepted)
        found: Expr = items[index]
        return found

    def _whole(self, node: ast.AST | None) -> int | None:
        if node is None:
            return None
        found = self.read(node)
        if type(found.value) is not int:
            self.refuse(node, ast.unparse(node), "a constant")
        return int(found.value)

    def _element(self, node: ast.Subscript, base: Expr) -> Expr:
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if len(places) != len(base.kind.shape):
            accepted = f"{len(base.kind.shape)} indices, whole numbers"
            self.refuse(node, ast.unparse(node), accepted)
        text = base.within(Level.LITERAL)
        for place, number in zip(places, base.kind.shape, strict=True):
            index = self.read(place)
            if index.kind is not WHOLE:
                self.refuse(place, f"{ast.unparse(place)}, {index.kind}", "a whole number")
            if index.value is not None and index.value < 0:
                length = self._length(node, number).value
                index = index._replace(text=str(length + index.value))
            text += f"[{index.text}]"
        return Expr(base.kind.element, text, place=True)

    def number(self, node: ast.AST) -> Expr:
        found = self.read(node)
        if found.kind not in (REAL, WHOLE, TRUTH):
            self.refuse(node, f"{ast.unparse(node)}, {found.kind}", "a number")
        return found

    def spread(self, nodes: list[ast.expr]) -> list[Expr]:
        """Expressions, starred ones part by part."""
        found: list[Expr] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                found += self.items(self.read(node.value))
            else:
                found.append(self.read(node))
        return found

    # Values where they are needed

    def given(self, found: Expr, kind: Kind, node: ast.AST, layout: Any = None) -> tuple[str, int]:
        """The text of a value of a type, and its precedence."""
        if isinstance(kind, Several):
            if found.items is None and found.layout is layout:
                return found.text, Level.LITERAL
            pairs = zip(self.items(found), kind.types, strict=True)
            parts = [self.given(e, k, node)[0] for e, k in pairs if not empty(k)]
            name = self.program.struct(kind, layout)
            return f"({name}){{{', '.join(parts)}}}", Level.LITERAL
        if isinstance(kind, Struct):
            if found.kind != kind:
                self.refuse(node, f"{found.kind}", f"a {kind} with fields of the same types")
            return found.text, Level.LITERAL
        if kinds.join(found.kind, kind) != kind:
            self.refuse(node, f"{ast.unparse(node)}, {found.kind}", f"a value of type {kind}")
        return found.text, found.level

    def address(self, found: Expr, node: ast.AST, name: str = "given") -> str:
        if isinstance(found.kind, Several) and (found.items is not None or found.layout):
            text, _ = self.given(found, found.kind, node)
            return f"&{text}"
        if found.text.startswith("(*"):
            return found.text[2:-1]
        if found.place or found.text.startswith("("):
            return f"&{found.text}"
        if self.depends:  # C99: an array of one, without a name
            return f"({self.program.struct(found.kind)}[]){{{found.text}}}"
        return f"&{self.kept(found, name).text}"

    def writes(self, node: ast.AST) -> None:
        """Note that an array is written to: a parameter or a field."""
        if isinstance(node, ast.Name) and node.id in self.source.parameters:
            self.written.add(node.id)
        elif isinstance(node, ast.Attribute):
            base = self.read(node.value).kind
            self.program.written.add((base.instance_class, node.attr))
        else:
            self.refuse(node, ast.unparse(node), "an array that is a parameter or a field")
