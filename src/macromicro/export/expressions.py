"""Expressions of a kernel in C: each with its type, and with no more brackets than it needs."""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.export import kinds
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty
from macromicro.export.sources import Source, Unknown
from macromicro.kernel import choice, is_kernel

if TYPE_CHECKING:
    from macromicro.export.program import Program

# How tightly C's operators bind.
LITERAL, PREFIX, TIMES, PLUS, LESS, EQUAL, AND, OR, CHOICE = 16, 15, 13, 12, 10, 9, 5, 4, 3
VALUE, PLACE, POINTER = "value", "place", "pointer"

LANGUAGE = (
    "the language of kernels (CONTRIBUTING.md): floats, ints, bools, NamedTuples, arrays of fixed "
    "size, if, for over range, while, math, other kernels"
)
_ARITHMETIC: dict[type, tuple[str, int]] = {
    ast.Add: ("+", PLUS),
    ast.Sub: ("-", PLUS),
    ast.Mult: ("*", TIMES),
    ast.Div: ("/", TIMES),
}
_COMPARED: dict[type, tuple[str, int]] = {
    ast.Lt: ("<", LESS),
    ast.LtE: ("<=", LESS),
    ast.Gt: (">", LESS),
    ast.GtE: (">=", LESS),
    ast.Eq: ("==", EQUAL),
    ast.NotEq: ("!=", EQUAL),
}
_TOLD: dict[type, Callable[[Any, Any], bool]] = {
    ast.Lt: lambda a, b: a < b,
    ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b,
    ast.Eq: lambda a, b: a == b,
    ast.NotEq: lambda a, b: a != b,
}
# Of `math`, what C has too, with the same bits: CPython computes others, such as hypot, itself.
_MATH = {
    name: name
    for name in (
        "sin cos tan asin acos atan atan2 sinh cosh tanh exp expm1 log log1p log2 log10 sqrt pow "
        "copysign fmod erf erfc"
    ).split()
} | {"fabs": "fabs"}
_ROUNDED = {"floor": "floor", "ceil": "ceil", "trunc": "trunc"}
_TESTS = {"isnan": "isnan", "isinf": "isinf", "isfinite": "isfinite"}


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


class Expressions:
    """What reads expressions of one kernel.

    Parameters
    ----------
    program : Program
        What it becomes a part of.
    source : Source
        The kernel.
    """

    def __init__(self, program: Program, source: Source) -> None:
        self.program = program
        self.source = source
        self.local: set[str] = set()
        self.kinds: dict[str, Kind] = {}
        self.forms: dict[str, str] = {}
        self.layouts: dict[str, Any] = {}
        self.named: dict[str, str] = {}
        self.steady: set[str] = set()
        self.before: list[str] = []  # lines that the present statement needs before it
        self.taken: set[str] = set()
        self.depends = 0  # above 0: what is read may never be computed
        self.written: set[str] = set()  # parameters whose arrays are written into

    def refuse(self, node: ast.AST, found: str, accepted: str = LANGUAGE) -> Any:
        """Raise the error of what cannot be exported."""
        self.source.refuse(node, found, accepted)

    @contextmanager
    def perhaps(self) -> Iterator[None]:
        """Around what is computed under a condition."""
        self.depends += 1
        try:
            yield
        finally:
            self.depends -= 1

    def read(self, node: ast.AST) -> Expr:
        """An expression."""
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
        """A constant: a number, a named one, or a ``NamedTuple``."""
        named = isinstance(node, ast.Name | ast.Attribute)
        if isinstance(value, bool | int | float):
            kind = kinds.of_value(value)
            exact = value if kind is not REAL else None
            if named and not isinstance(value, bool) and math.isfinite(value):
                name = node.id if isinstance(node, ast.Name) else node.attr  # type: ignore[attr-defined]
                text = self.program.constant(name, self.source.home(node), value)
                return Expr(kind, text, value=exact)
            text = self.program.number(value)
            return Expr(kind, text, PREFIX if text.startswith("-") else LITERAL, value=exact)
        if isinstance(value, tuple):
            try:
                kind = kinds.of_value(value)
            except kinds.Unlike as error:
                self.refuse(node, f"{ast.unparse(node)}, {error}")
            return Expr(kind, self.program.literal(value, kind))
        return self.refuse(node, ast.unparse(node))  # type: ignore[no-any-return]

    # Names, fields, items

    def _name(self, node: ast.Name) -> Expr:
        if node.id not in self.kinds:
            self.refuse(node, node.id, "a variable that has a value by then, or a constant")
        kind = self.kinds[node.id]
        return Expr(
            kind,
            self.named[node.id],
            form=self.forms.get(node.id, PLACE),
            layout=self.layouts.get(node.id),
            stable=node.id in self.steady,
        )

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
        """A field of a ``NamedTuple``."""
        if base.items is not None:
            found: Expr = base.items[base.kind.fields.index(name)]
            return found
        kind = base.kind.part(name)
        dot = "->" if base.form == POINTER else "."
        text = f"{base.within(LITERAL)}{dot}{self.program.legal(name)}"
        form = VALUE if base.form == VALUE else PLACE
        return Expr(kind, text, form=form, stable=base.stable)

    def items(self, whole: Expr, name: str = "pair") -> tuple[Expr, ...]:
        """The parts of a tuple."""
        if whole.items is not None:
            return whole.items
        if isinstance(whole.kind, Struct):
            return tuple(self.field(whole, each) for each in whole.kind.fields)
        if empty(whole.kind):
            return tuple(Expr(kind, "", items=()) for kind in whole.kind.types)
        base = self.kept(whole, name) if whole.form == VALUE else whole
        names = self.program.parts(whole.kind, whole.layout)
        dot = "->" if base.form == POINTER else "."
        return tuple(
            Expr(kind, f"{base.text}{dot}{n}", form=PLACE, stable=base.stable)
            for n, kind in zip(names, whole.kind.types, strict=True)
        )

    def kept(self, found: Expr, name: str) -> Expr:
        """A value put into a variable before the present statement."""
        free = self.fresh(name)
        declared = self.program.declared(found.kind, free, layout=found.layout)
        self.before.append(f"const {declared} = {found.text};")
        return found._replace(text=free, form=PLACE, level=LITERAL, stable=True)

    def fresh(self, name: str) -> str:
        """A name that no variable has."""
        free, number = name, 2
        while free in self.taken or free in self.named.values():
            free, number = f"{name}_{number}", number + 1
        self.taken.add(free)
        return free

    def _length(self, node: ast.AST, number: int | None) -> Expr:
        if number is None:
            self.refuse(node, "the length of an array that only the caller knows")
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
        found: Expr = items[index]  # type: ignore[index]
        return found

    def _whole(self, node: ast.AST | None) -> int | None:
        """A whole number that is known here."""
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
        text = base.within(LITERAL)
        for place, number in zip(places, base.kind.shape, strict=True):
            index = self.read(place)
            if index.kind is not WHOLE:
                self.refuse(place, f"{ast.unparse(place)}, {index.kind}", "a whole number")
            shown = index.text
            if index.value is not None and index.value < 0:
                shown = self._length(node, number).text if number is None else (
                    str(number + index.value)
                )  # fmt: skip
            text += f"[{shown}]"
        return Expr(base.kind.element, text, form=PLACE)

    # Operators

    def number(self, node: ast.AST) -> Expr:
        """An expression that must be a number."""
        found = self.read(node)
        if found.kind not in (REAL, WHOLE, TRUTH):
            self.refuse(node, f"{ast.unparse(node)}, {found.kind}", "a number")
        return found

    def _binop(self, node: ast.BinOp) -> Expr:
        left, right = self.number(node.left), self.number(node.right)
        both = WHOLE if REAL not in (left.kind, right.kind) else REAL
        if type(node.op) in _ARITHMETIC:
            sign, level = _ARITHMETIC[type(node.op)]
            first = left.within(level)
            if sign == "/" and both is WHOLE:
                first, both = f"({self.program.real}){left.within(PREFIX)}", REAL
            second = right.within(level + 1)
            return Expr(both, f"{first} {sign} {second}", level)
        names = {ast.FloorDiv: "quotient", ast.Mod: "remainder"}
        if type(node.op) in names:
            suffix = "_int" if both is WHOLE else ""
            name = self.program.helper(f"floor_{names[type(node.op)]}{suffix}")
            return Expr(both, f"{name}({left.text}, {right.text})")
        if isinstance(node.op, ast.Pow) and both is REAL:
            return Expr(REAL, f"{self.program.math('pow')}({left.text}, {right.text})")
        return self.refuse(node, ast.unparse(node), "+ - * / // %, and ** of floats")  # type: ignore[no-any-return]

    def _unaryop(self, node: ast.UnaryOp) -> Expr:
        found = self.number(node.operand)
        if isinstance(node.op, ast.Not):
            known = None if found.value is None else not found.value
            return Expr(TRUTH, f"!{found.within(PREFIX)}", PREFIX, value=known)
        if isinstance(node.op, ast.UAdd):
            return found
        if not isinstance(node.op, ast.USub):
            self.refuse(node, ast.unparse(node))
        text = found.within(PREFIX)
        shown = f"({text})" if text.startswith("-") else text
        kind = WHOLE if found.kind is TRUTH else found.kind
        return Expr(kind, f"-{shown}", PREFIX)

    def _boolop(self, node: ast.BoolOp) -> Expr:
        word, level = ("&&", AND) if isinstance(node.op, ast.And) else ("||", OR)
        ends = word == "||"  # the value that decides
        parts: list[str] = []
        for place, each in enumerate(node.values):
            if place == 0:
                found = self.number(each)
            else:
                with self.perhaps():
                    found = self.number(each)
            if found.kind is not TRUTH:
                self.refuse(each, f"{ast.unparse(each)}, {found.kind}", "a truth value")
            if found.value is ends and not parts:
                return found
            if found.value is None or found.value is ends:
                # Brackets that C does not need, but readers and compilers ask for.
                inner = LITERAL if found.level in (AND, OR) and found.level != level else level
                parts.append(found.within(inner))
            if found.value is ends:
                break
        if not parts:
            return Expr(TRUTH, "false" if ends else "true", value=not ends)
        return Expr(TRUTH, f" {word} ".join(parts), level if len(parts) > 1 else LESS)

    def _compare(self, node: ast.Compare) -> Expr:
        terms = [node.left, *node.comparators]
        parts = []
        for sign, left, right in zip(node.ops, terms, terms[1:], strict=False):
            if isinstance(sign, ast.In) and isinstance(right, ast.Tuple) and len(terms) == 2:
                equal = [ast.Compare(left, [ast.Eq()], [each]) for each in right.elts]
                return self._boolop(
                    ast.copy_location(ast.BoolOp(ast.Or(), list(equal)), node)
                )  # fmt: skip
            if type(sign) not in _COMPARED:
                self.refuse(node, ast.unparse(node), "< <= > >= == !=, in (A, B)")
            a, b = self.number(left), self.number(right)
            word, level = _COMPARED[type(sign)]
            known = None
            if a.value is not None and b.value is not None:
                known = _TOLD[type(sign)](a.value, b.value)
            text = f"{a.within(LESS + 1)} {word} {b.within(LESS + 1)}"
            parts.append(Expr(TRUTH, text, level, value=known))
        if len(parts) == 1:
            return parts[0]
        return Expr(TRUTH, " && ".join(each.text for each in parts), AND)

    def _ifexp(self, node: ast.IfExp) -> Expr:
        test = self.number(node.test)
        if test.value is not None:
            return self.read(node.body if test.value else node.orelse)
        with self.perhaps():
            one, other = self.read(node.body), self.read(node.orelse)
        kind = kinds.joined(one.kind, other.kind)
        if kind is None or isinstance(kind, Rows | Several):
            self.refuse(node, f"{one.kind} or {other.kind}", "two values of one type")
        chosen = [self.given(each, kind, node) for each in (one, other)]
        a, b = (t if lv > CHOICE else f"({t})" for t, lv in chosen)
        return Expr(kind, f"{test.within(CHOICE + 1)} ? {a} : {b}", CHOICE)

    def _tuple(self, node: ast.Tuple) -> Expr:
        items = self.spread(node.elts)
        return Expr(Several(tuple(each.kind for each in items)), "", items=tuple(items))

    def spread(self, nodes: list[ast.expr]) -> list[Expr]:
        """Expressions, those under a star part by part."""
        found: list[Expr] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                found += self.items(self.read(node.value))
            else:
                found.append(self.read(node))
        return found

    # Values where they are needed

    def given(self, found: Expr, kind: Kind, node: ast.AST, layout: Any = None) -> tuple[str, int]:
        """The text of a value of a type, and how tightly it binds."""
        if isinstance(kind, Several):
            if found.items is None and found.layout is layout:
                return ("*" if found.form == POINTER else "") + found.text, PREFIX
            pairs = zip(self.items(found), kind.types, strict=True)
            parts = [self.given(e, k, node)[0] for e, k in pairs if not empty(k)]
            name = self.program.tuple_name(kind, layout)
            return f"({name}){{{', '.join(parts)}}}", LITERAL
        if isinstance(kind, Struct):
            if found.kind != kind:
                self.refuse(node, f"{found.kind}", f"a {kind} with fields of the same types")
            return (f"*{found.text}", PREFIX) if found.form == POINTER else (found.text, LITERAL)
        if kinds.joined(found.kind, kind) != kind:
            self.refuse(node, f"{ast.unparse(node)}, {found.kind}", f"a value of type {kind}")
        return found.text, found.level

    def address(self, found: Expr, node: ast.AST, name: str = "given") -> str:
        """What points at a ``NamedTuple`` or a tuple."""
        if isinstance(found.kind, Several) and (found.items is not None or found.layout):
            text, _ = self.given(found, found.kind, node)
            return f"&{text}"
        if found.form == POINTER:
            return found.text
        if found.form == PLACE or found.text.startswith("("):
            return f"&{found.text}"
        if self.depends:  # C99: an array of one, without a name
            return f"({self.program.struct(found.kind)}[]){{{found.text}}}"
        return f"&{self.kept(found, name).text}"

    # Calls

    def _call(self, node: ast.Call) -> Expr:
        try:
            function = self.source.constant(node.func, self.local)
        except Unknown:
            return self.refuse(node, ast.unparse(node))  # type: ignore[no-any-return]
        name = getattr(function, "__name__", "")
        if function in (abs, min, max, float, int, bool, len, round):
            return self._built_in(node, name)
        if getattr(math, name, None) is function:
            return self._mathematics(node, name)
        if isinstance(function, type) and issubclass(function, tuple):
            return self._made(node, function)
        if is_kernel(function) or choice(function) is not None:
            return self._routine(node, function)
        accepted = f"a kernel (under @kernel), a NamedTuple, math; {LANGUAGE}"
        return self.refuse(node, ast.unparse(node.func), accepted)  # type: ignore[no-any-return]

    def _built_in(self, node: ast.Call, name: str) -> Expr:
        if name == "len" and len(node.args) == 1:
            whole = self.read(node.args[0])
            size = whole.kind.shape[0] if isinstance(whole.kind, Rows) else len(whole.kind)
            return self._length(node, size)
        found = [self.number(each) for each in node.args]
        first, alone = found[0], len(found) == 1
        if node.keywords or not (alone or name in ("min", "max")):
            self.refuse(node, ast.unparse(node))
        if name in ("min", "max") and not alone:
            kind = REAL if any(each.kind is REAL for each in found) else WHOLE
            helper = self.program.helper(name if kind is REAL else f"{name}_int")
            text = first.text
            for each in found[1:]:
                text = f"{helper}({text}, {each.text})"
            return Expr(kind, text)
        if name == "abs":
            helper = self.program.math("fabs")
            if first.kind is not REAL:
                helper = self.program.helper("abs_int")
            return Expr(REAL if first.kind is REAL else WHOLE, f"{helper}({first.text})")
        if name == "float":
            if first.kind is REAL:
                return first
            return Expr(REAL, f"({self.program.real}){first.within(PREFIX)}", PREFIX)
        if name == "bool":
            if first.kind is TRUTH:
                return first
            return Expr(TRUTH, f"{first.within(LESS + 1)} != 0", EQUAL)
        if name in ("int", "round"):
            if first.kind is not REAL:
                return first._replace(kind=WHOLE)
            inner = f"{self.program.math('rint')}({first.text})" if name == "round" else first.text
            return Expr(WHOLE, f"{self.program.helper('whole')}({inner})")
        return self.refuse(node, ast.unparse(node))  # type: ignore[no-any-return]

    def _mathematics(self, node: ast.Call, name: str) -> Expr:
        found = [self.number(each) for each in node.args]
        given = ", ".join(each.text for each in found)
        if name in _TESTS:
            if found[0].kind is not REAL:
                self.refuse(node, ast.unparse(node), "a float")
            return Expr(TRUTH, f"{_TESTS[name]}({given})")
        if name in _ROUNDED:
            inner = f"{self.program.math(_ROUNDED[name])}({given})"
            return Expr(WHOLE, f"{self.program.helper('whole')}({inner})")
        if name not in _MATH or node.keywords:
            every = ", ".join(sorted({*_MATH, *_TESTS, *_ROUNDED}))
            self.refuse(node, f"math.{name}", f"of math: {every}")
        return Expr(REAL, f"{self.program.math(_MATH[name])}({given})")

    def _matched(self, node: ast.Call, names: list[str], defaults: dict[str, Any]) -> list[Expr]:
        """Arguments in the order of the parameters."""
        found = dict(zip(names, self.spread(node.args), strict=False))
        found.update({each.arg: self.read(each.value) for each in node.keywords if each.arg})
        for name in names:
            if name not in found and name in defaults:
                found[name] = self.constant(node, defaults[name])
        if set(found) != set(names):
            self.refuse(node, ast.unparse(node), f"arguments {', '.join(names)}")
        return [found[name] for name in names]

    def _made(self, node: ast.Call, made: Any) -> Expr:
        names, hints = list(made._fields), kinds.hints_of(made)
        found = self._matched(node, names, made._field_defaults)
        types = tuple(
            REAL if hints.get(n) is float and e.kind in (WHOLE, TRUTH) else e.kind
            for n, e in zip(names, found, strict=True)
        )
        kind = Struct(made, types)
        parts = [
            (name, self.given(each, part, node)[0])
            for name, each, part in zip(names, found, types, strict=True)
            if not empty(part)
        ]
        return Expr(kind, self.program.compound(kind, parts))

    def _routine(self, node: ast.Call, function: Callable[..., Any]) -> Expr:
        signature = inspect.signature(function)
        defaults = {
            name: each.default
            for name, each in signature.parameters.items()
            if each.default is not inspect.Parameter.empty
        }
        names = list(signature.parameters)
        found = self._matched(node, names, defaults)
        hints = kinds.hints_of(function)
        types = tuple(
            REAL if hints.get(n) is float and e.kind in (WHOLE, TRUTH) else e.kind
            for n, e in zip(names, found, strict=True)
        )
        routine = self.program.routine(function, types, (self.source, node))
        parts = []
        for place, (name, each, part) in enumerate(zip(names, found, types, strict=True)):
            if empty(part):
                continue
            if isinstance(part, Struct | Several):
                parts.append(self.address(each, node, name))
                continue
            if isinstance(part, Rows) and name in routine.written:
                self.writes(node.args[place])
            parts.append(self.given(each, part, node)[0] if not isinstance(part, Rows) else each.text)
        text = f"{routine.name}({', '.join(parts)})"
        layout = routine if isinstance(routine.result, Several) else None
        return Expr(routine.result, text, layout=layout)

    def writes(self, node: ast.AST) -> None:
        """Note that an array is written into: a parameter's, or that of a field."""
        if isinstance(node, ast.Name) and node.id in self.source.parameters:
            self.written.add(node.id)
        elif isinstance(node, ast.Attribute):
            base = self.read(node.value).kind
            self.program.written.add((base.instance_class, node.attr))
        else:
            self.refuse(node, ast.unparse(node), "an array that is a parameter or a field")
