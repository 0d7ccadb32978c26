"""Operators of a kernel in C, with the fewest brackets."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

from macromicro.export import kinds
from macromicro.export._expr import (
    AND,
    CHOICE,
    EQUAL,
    LESS,
    LITERAL,
    OR,
    PLUS,
    PREFIX,
    TIMES,
    Expr,
)
from macromicro.export._reading import Reading
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Rows, Several

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


class Operators(Reading):
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
        return self.refuse(node, ast.unparse(node), "+ - * / // %, and ** of floats")

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
        a, b = (t if lv > CHOICE else f"({t})" for t, lv in chosen)
        return Expr(kind, f"{test.within(CHOICE + 1)} ? {a} : {b}", CHOICE)

    def _tuple(self, node: ast.Tuple) -> Expr:
        items = self.spread(node.elts)
        return Expr(Several(tuple(each.kind for each in items)), "", items=tuple(items))
