"""Calls of a kernel in C: other kernels, `math`, Python's built-ins, ``NamedTuple``s."""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable
from typing import Any

from macromicro.export import kinds
from macromicro.export._expr import EQUAL, LANGUAGE, LESS, PREFIX, Expr
from macromicro.export._operators import Operators
from macromicro.export._sources import Unknown
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Rows, Several, Struct, empty
from macromicro.kernel import choice, is_kernel

# Of `math`, what C has too, with the same bits: CPython computes others, such as hypot, itself.
_TRIGONOMETRY = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh")
_OTHERS = ("sqrt", "pow", "fabs", "copysign", "fmod", "erf", "erfc")
_MATH = (*_TRIGONOMETRY, "exp", "expm1", "log", "log1p", "log2", "log10", *_OTHERS)
_ROUNDED = ("floor", "ceil", "trunc")
_TESTS = ("isnan", "isinf", "isfinite")


class Expressions(Operators):
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
            return Expr(REAL, f"({self.program.real}){found.within(PREFIX)}", PREFIX)
        if name == "bool" and found.kind is not TRUTH:
            return Expr(TRUTH, f"{found.within(LESS + 1)} != 0", EQUAL)
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

    def _matched(self, node: ast.Call, names: list[str], defaults: dict[str, Any]) -> list[Expr]:
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
        self._ordered(node, routine.mutates)
        parts = []
        for place, (name, each, part) in enumerate(zip(names, found, types, strict=True)):
            if empty(part):
                continue
            if isinstance(part, Struct | Several):
                parts.append(self.address(each, node, name))
                continue
            if isinstance(part, Rows) and name in routine.written:
                self.writes(node.args[place])
            parts.append(
                self.given(each, part, node)[0] if not isinstance(part, Rows) else each.text
            )
        text = f"{routine.name}({', '.join(parts)})"
        layout = routine if isinstance(routine.result, Several) else None
        return Expr(routine.result, text, layout=layout)

    def _ordered(self, node: ast.Call, changes: bool) -> None:
        """C evaluates operands in any order: one that changes an array stands alone."""
        self.called += 1
        self.changing = self.changing or changes
        self.mutates = self.mutates or changes
        if self.changing and self.called > 1:
            accepted = "a kernel that changes an array alone in its statement"
            self.refuse(node, ast.unparse(node), accepted)
