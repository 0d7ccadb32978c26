"""Expressions of a kernel in C: operators, with the fewest brackets, and calls."""

from __future__ import annotations

import ast
import inspect
import math
import operator
from collections.abc import Callable
from typing import Any

from macromicro.export import kinds
from macromicro.export._reading import LANGUAGE, Expr, Level, Reading
from macromicro.export._sources import Unknown
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Rows, Several, Struct, empty
from macromicro.kernel import choice, is_kernel

_ARITHMETIC: dict[type, tuple[str, int, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", Level.PLUS, operator.add),
    ast.Sub: ("-", Level.PLUS, operator.sub),
    ast.Mult: ("*", Level.TIMES, operator.mul),
    ast.Div: ("/", Level.TIMES, operator.truediv),
}
_COMPARED: dict[type, tuple[str, int, Callable[[Any, Any], bool]]] = {
    ast.Lt: ("<", Level.LESS, operator.lt),
    ast.LtE: ("<=", Level.LESS, operator.le),
    ast.Gt: (">", Level.LESS, operator.gt),
    ast.GtE: (">=", Level.LESS, operator.ge),
    ast.Eq: ("==", Level.EQUAL, operator.eq),
    ast.NotEq: ("!=", Level.EQUAL, operator.ne),
}
# Of `math`, what C has too, with the same bits: CPython computes others, such as hypot, itself.
_TRIGONOMETRY = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh")
_OTHERS = ("sqrt", "pow", "fabs", "copysign", "fmod", "erf", "erfc")
_MATH = (*_TRIGONOMETRY, "exp", "expm1", "log", "log1p", "log2", "log10", *_OTHERS)
_ROUNDED = ("floor", "ceil", "trunc")
_TESTS = ("isnan", "isinf", "isfinite")


class Expressions(Reading):
    def _binop(self, node: ast.BinOp) -> Expr:
        left, right = self.number(node.left), self.number(node.right)
        both = WHOLE if REAL not in (left.kind, right.kind) else REAL
        if type(node.op) in _ARITHMETIC:
            sign, level, compute = _ARITHMETIC[type(node.op)]
            first, known = left.within(level), None
            if sign == "/" and both is WHOLE:
                first, both = f"({self.program.real}){left.within(Level.PREFIX)}", REAL
            elif left.value is not None and right.value is not None:
                known = compute(left.value, right.value)
            return Expr(both, f"{first} {sign} {right.within(level + 1)}", level, value=known)
        names = {ast.FloorDiv: "quotient", ast.Mod: "remainder"}
        if type(node.op) in names:
            suffix = "_int" if both is WHOLE else ""
            name = self.program.helper(f"floor_{names[type(node.op)]}{suffix}")
            return Expr(both, f"{name}({left.text}, {right.text})")
        if isinstance(node.op, ast.Pow) and both is REAL:
            return Expr(REAL, f"{self.program.math('pow')}({left.text}, {right.text})")
        return self.refuse(node, ast.unparse(node), "+ - * / // %, and ** of floats")

    def _unaryop(self, node: ast.UnaryOp) -> Expr:
        found = self.number(node.operand)
        if isinstance(node.op, ast.Not):
            known = None if found.value is None else not found.value
            return Expr(TRUTH, f"!{found.within(Level.PREFIX)}", Level.PREFIX, value=known)
        if isinstance(node.op, ast.UAdd):
            return found
        if not isinstance(node.op, ast.USub):
            self.refuse(node, ast.unparse(node))
        text = found.within(Level.PREFIX)
        shown = f"({text})" if text.startswith("-") else text
        kind = WHOLE if found.kind is TRUTH else found.kind
        known = None if found.value is None else -found.value
        return Expr(kind, f"-{shown}", Level.PREFIX, value=known)

    def _boolop(self, node: ast.BoolOp) -> Expr:
        word, level = ("&&", Level.AND) if isinstance(node.op, ast.And) else ("||", Level.OR)
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
                other = found.level in (Level.AND, Level.OR) and found.level != level
                parts.append(found.within(Level.LITERAL if other else level))
            if found.value is ends:
                break
        if not parts:
            return Expr(TRUTH, "false" if ends else "true", value=not ends)
        return Expr(TRUTH, f" {word} ".join(parts), level if len(parts) > 1 else Level.LESS)

    def _compare(self, node: ast.Compare) -> Expr:
        terms = [node.left, *node.comparators]
        parts = []
        for sign, left, right in zip(node.ops, terms, terms[1:], strict=False):
            if isinstance(sign, ast.In) and isinstance(right, ast.Tuple) and len(terms) == 2:
                equal: list[ast.expr] = [
                    ast.Compare(left, [ast.Eq()], [each]) for each in right.elts
                ]
                return self._boolop(ast.copy_location(ast.BoolOp(ast.Or(), equal), node))
            if type(sign) not in _COMPARED:
                self.refuse(node, ast.unparse(node), "< <= > >= == !=, in (A, B)")
            a, b = self.number(left), self.number(right)
            word, level, compare = _COMPARED[type(sign)]
            both = a.value is not None and b.value is not None
            known = compare(a.value, b.value) if both else None
            text = f"{a.within(Level.LESS + 1)} {word} {b.within(Level.LESS + 1)}"
            parts.append(Expr(TRUTH, text, level, value=known))
        if len(parts) == 1:
            return parts[0]
        return Expr(TRUTH, " && ".join(each.text for each in parts), Level.AND)

    def _ifexp(self, node: ast.IfExp) -> Expr:
        test = self.number(node.test)
        if test.value is not None:
            return self.read(node.body if test.value else node.orelse)
        with self.perhaps():
            one, other = self.read(node.body), self.read(node.orelse)
        kind = kinds.join(one.kind, other.kind)
        if isinstance(kind, Several) and one.items is not None and other.items is not None:
            pairs = zip(one.items, other.items, kind.types, strict=True)
            items = tuple(self._either(node, test, a, b, part) for a, b, part in pairs)
            return Expr(kind, "", items=items)
        return self._either(node, test, one, other, kind)

    def _either(self, node: ast.IfExp, test: Expr, one: Expr, other: Expr, kind: Any) -> Expr:
        """One value or another, of one type."""
        if kind is None or isinstance(kind, Rows | Several):
            self.refuse(node, f"{one.kind} or {other.kind}", "two values of one type")
        chosen = [self.given(each, kind, node) for each in (one, other)]
        a, b = (t if lv > Level.CHOICE else f"({t})" for t, lv in chosen)
        return Expr(kind, f"{test.within(Level.CHOICE + 1)} ? {a} : {b}", Level.CHOICE)

    def _tuple(self, node: ast.Tuple) -> Expr:
        items = self.spread(node.elts)
        return Expr(Several(tuple(each.kind for each in items)), "", items=tuple(items))

    def _call(self, node: ast.Call) -> Expr:
        try:
            function = self.source.constant(node.func, self.local)
        except Unknown:
            return self.refuse(node, ast.unparse(node))
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
        return self.refuse(node, ast.unparse(node.func), accepted)

    def _built_in(self, node: ast.Call, name: str) -> Expr:
        if name == "len" and len(node.args) == 1:
            whole = self.read(node.args[0])
            size = whole.kind.shape[0] if isinstance(whole.kind, Rows) else len(whole.kind)
            return self._length(node, size)
        found = [self.number(each) for each in node.args]
        if name in ("min", "max") and len(found) > 1 and not node.keywords:
            kind = REAL if any(each.kind is REAL for each in found) else WHOLE
            helper = self.program.helper(f"{name}_of" if kind is REAL else f"{name}_of_int")
            text = found[0].text
            for each in found[1:]:
                text = f"{helper}({text}, {each.text})"
            return Expr(kind, text)
        if node.keywords or len(found) != 1 or name in ("min", "max", "len"):
            self.refuse(node, ast.unparse(node))
        return self._converted(found[0], name)

    def _converted(self, found: Expr, name: str) -> Expr:
        """A number converted by abs, float, bool, int or round."""
        real = found.kind is REAL
        if name == "abs":
            helper = self.program.math("fabs") if real else self.program.helper("abs_of_int")
            return Expr(REAL if real else WHOLE, f"{helper}({found.text})")
        if name == "float" and not real:
            return Expr(REAL, f"({self.program.real}){found.within(Level.PREFIX)}", Level.PREFIX)
        if name == "bool" and found.kind is not TRUTH:
            return Expr(TRUTH, f"{found.within(Level.LESS + 1)} != 0", Level.EQUAL)
        if name in ("int", "round"):
            if not real:
                return found._replace(kind=WHOLE)
            inner = f"{self.program.math('rint')}({found.text})" if name == "round" else found.text
            return Expr(WHOLE, f"{self.program.helper('whole')}({inner})")
        return found

    def _mathematics(self, node: ast.Call, name: str) -> Expr:
        found = [self.number(each) for each in node.args]
        given = ", ".join(each.text for each in found)
        if name in _TESTS:
            if found[0].kind is not REAL:
                self.refuse(node, ast.unparse(node), "a float")
            return Expr(TRUTH, f"{name}({given})")
        if name in _ROUNDED:
            inner = f"{self.program.math(name)}({given})"
            return Expr(WHOLE, f"{self.program.helper('whole')}({inner})")
        if name not in _MATH or node.keywords:
            every = ", ".join(sorted({*_MATH, *_TESTS, *_ROUNDED}))
            self.refuse(node, f"math.{name}", f"of math: {every}")
        return Expr(REAL, f"{self.program.math(name)}({given})")

    def _matched(self, node: ast.Call, made: Callable[..., Any]) -> dict[str, Expr]:
        """The arguments of a call by name, in the order of the function or class."""
        named = {each.arg: self.read(each.value) for each in node.keywords if each.arg}
        signature = inspect.signature(made)
        try:
            bound = signature.bind(*self.spread(node.args), **named)
        except TypeError:
            names = ", ".join(signature.parameters)
            return self.refuse(node, ast.unparse(node), f"arguments {names}")
        bound.apply_defaults()
        return {
            name: each if isinstance(each, Expr) else self.constant(node, each)
            for name, each in bound.arguments.items()
        }

    def _made(self, node: ast.Call, made: Any) -> Expr:
        found = self._matched(node, made)
        kind = Struct(made, kinds.widen(made, [each.kind for each in found.values()]))
        parts = [
            (name, self.given(each, part, node)[0])
            for (name, each), part in zip(found.items(), kind.types, strict=True)
            if not empty(part)
        ]
        return Expr(kind, self.program.compound(kind, parts))

    def _routine(self, node: ast.Call, function: Callable[..., Any]) -> Expr:
        found = list(self._matched(node, function).values())
        types = [each.kind for each in found]
        routine = self.program.routine(function, types, (self.source, node))
        self._ordered(node, routine.mutates)
        parts = []
        for place, (name, part) in enumerate(routine.parameters.items()):
            if isinstance(part, Rows):
                if name in routine.written:
                    self.writes(node.args[place])
                parts.append(found[place].text)
            elif not empty(part):
                by_address = isinstance(part, Struct | Several)
                parts.append(
                    self.address(found[place], node, name)
                    if by_address
                    else self.given(found[place], part, node)[0]
                )
        return Expr(routine.result, f"{routine.name}({', '.join(parts)})", layout=routine)

    def _ordered(self, node: ast.Call, changes: bool) -> None:
        """C evaluates operands in any order: one that changes an array stands alone."""
        self.called += 1
        self.changing = self.changing or changes
        self.mutates = self.mutates or changes
        if self.changing and self.called > 1:
            accepted = "a kernel that changes an array alone in its statement"
            self.refuse(node, ast.unparse(node), accepted)
