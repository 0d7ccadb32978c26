"""Statements of a kernel in C."""

from __future__ import annotations

import ast
from typing import Any

from macromicro.export import kinds
from macromicro.export._calls import Expressions
from macromicro.export._expr import POINTER, VALUE, Expr
from macromicro.export._naming import legal
from macromicro.export._scopes import Scopes, targets
from macromicro.export.kinds import REAL, WHOLE, Kind, Rows, Several, Struct, empty

INDENT = "    "


class Statements(Expressions):
    scopes: Scopes
    parameters: dict[str, Kind]
    result: Any  # type of what it returns, as the last reading found it
    returned: list[str]  # names in its first `return`
    _declared: set[str]
    _result: Any

    def _block(self, block: list[ast.stmt], depth: int) -> list[str]:
        lines: list[str] = []
        depends, self.depends = self.depends, 0
        last = block[0].lineno
        for place, node in enumerate(block):
            pad = INDENT * depth
            self.before = []
            self.statement, self.called, self.changing = node, 0, False
            lines += self._comments(last, _behind_head(node), pad)
            last = (node.end_lineno or node.lineno) + 1
            for name in self.scopes.bare(node, (id(block), place)):
                if name in self.kinds and not empty(self.kinds[name]):
                    lines += [f"{pad}{line}" for line in self._bare(name)]
            method = getattr(self, f"_do_{type(node).__name__.lower()}", None)
            if method is None:
                self.refuse(node, ast.unparse(node).partition("\n")[0])
            found = method(node, depth)
            lines += [pad + line for line in self.before] + found
            if isinstance(node, ast.Return | ast.Break | ast.Continue) or self._ends(node):
                break
        self.depends = depends
        return lines

    def _ends(self, node: ast.stmt) -> bool:
        """Whether an `if` decided at export was left by its only branch."""
        if not isinstance(node, ast.If):
            return False
        known = self.number(node.test).value
        chosen = [] if known is None else node.body if known else node.orelse
        return bool(chosen) and isinstance(chosen[-1], ast.Return)

    def _comments(self, first: int, end: int, pad: str) -> list[str]:
        return [pad + line for line in self.source.comments(first, end)]

    def _bare(self, name: str) -> list[str]:
        """Declaration of a variable that is set in one branch or another."""
        if name in self._declared:
            return []
        self._declared.add(name)
        kind = self.kinds[name]
        start = f" = {self.program.number(0.0 if kind is REAL else 0)}"
        if not isinstance(kind, kinds.Scalar):
            start = ""
        if kind is kinds.TRUTH:
            start = " = false"
        return [self.program.declared(kind, self.named[name]) + start + ";"]

    def _do_expr(self, node: ast.Expr, depth: int) -> list[str]:
        if isinstance(node.value, ast.Constant):
            return []
        if not isinstance(node.value, ast.Call):
            self.refuse(node, ast.unparse(node))
        return [f"{INDENT * depth}{self.read(node.value).text};"]

    def _do_pass(self, node: ast.Pass, depth: int) -> list[str]:
        return []

    def _do_break(self, node: ast.Break, depth: int) -> list[str]:
        return [f"{INDENT * depth}break;"]

    def _do_continue(self, node: ast.Continue, depth: int) -> list[str]:
        return [f"{INDENT * depth}continue;"]

    def _do_annassign(self, node: ast.AnnAssign, depth: int) -> list[str]:
        if node.value is None or not isinstance(node.target, ast.Name):
            self.refuse(node, ast.unparse(node))
        return self._set(node.target.id, self.read(node.value), node, depth)

    def _do_assign(self, node: ast.Assign, depth: int) -> list[str]:
        if len(node.targets) != 1:
            self.refuse(node, ast.unparse(node), "one target")
        target = node.targets[0]
        if isinstance(target, ast.Name):
            return self._set(target.id, self.read(node.value), node, depth)
        if isinstance(target, ast.Subscript):
            return [INDENT * depth + self._stored(target, self.number(node.value))]
        if not isinstance(target, ast.Tuple):
            self.refuse(node, ast.unparse(node))
        return self._several(node, target, depth)

    def _stored(self, target: ast.Subscript, found: Expr, sign: str = "=") -> str:
        place = self.read(target)
        if not isinstance(self.read(target.value).kind, Rows):
            self.refuse(target, ast.unparse(target), "an item of an array")
        self.writes(target.value)
        self.mutates = True
        return f"{place.text} {sign} {found.text};"

    def _several(self, node: ast.Assign, target: ast.Tuple, depth: int) -> list[str]:
        names = [each.id if isinstance(each, ast.Name) else "" for each in target.elts]
        items = [each for each in target.elts if isinstance(each, ast.Subscript)]
        reads = any(isinstance(each, ast.Subscript) for each in ast.walk(node.value))
        if len(items) + sum(map(bool, names)) < len(names) or (items and reads):
            self.refuse(node, ast.unparse(node), "names on the left")
        called = node.value.func if isinstance(node.value, ast.Call) else None
        name = ast.unparse(called).rpartition(".")[2].lstrip("_") if called else "pair"
        whole = self.read(node.value)
        if not isinstance(whole.kind, Several | Struct) or len(whole.kind) != len(names):
            self.refuse(node, ast.unparse(node), f"{len(names)} values")
        if not items and not any(self.scopes.loads[each] for each in names) and called is not None:
            return [f"{INDENT * depth}{whole.text};"]
        found = list(self.items(whole, f"{name}_out"))
        if isinstance(node.value, ast.Tuple):
            self._apart(names, node.value.elts, found)
        lines = []
        for each, name, value in zip(target.elts, names, found, strict=True):
            if isinstance(each, ast.Subscript):
                lines.append(INDENT * depth + self._stored(each, value))
            elif self.scopes.loads[name]:
                lines += self._set(name, value, node, depth)
        return lines

    def _apart(self, names: list[str], nodes: list[ast.expr], found: list[Expr]) -> None:
        """Keep values that a later assignment of the same statement would read."""
        if any(isinstance(each, ast.Starred) for each in nodes):
            return
        for place, node in enumerate(nodes):
            read = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
            if read & set(names[:place]) and found[place].items is None:
                plain = found[place]
                if isinstance(plain.kind, Struct):
                    plain = plain._replace(text=self.given(plain, plain.kind, node)[0])
                found[place] = self.kept(plain, f"new_{names[place]}")._replace(stable=False)

    def _set(self, name: str, found: Expr, node: ast.stmt, depth: int) -> list[str]:
        pad = INDENT * depth
        if name in self.kinds and name not in self.parameters:
            kind = kinds.joined(self.kinds[name], found.kind)
        else:
            kind = self.kinds.get(name, found.kind)
        if kind is None or found.kind is None:
            was = self.kinds.get(name)
            self.refuse(node, f"{name}, {was} and {found.kind}", "one type for each variable")
        self.kinds[name] = kind
        here = name not in self._declared and name not in self.parameters
        self._declared.add(name)
        if empty(kind):
            return []
        once = self.scopes.stores[name] == 1
        if not self.scopes.loads[name] and found.form == VALUE and "(" not in found.text:
            return []
        if here and once:
            self.steady.add(name)
            if found.stable and isinstance(kind, Struct) and found.form != VALUE:
                self.forms[name] = POINTER
                to = self.program.declared(kind, f"*{self.named[name]}")
                return [f"{pad}const {to} = {self.address(found, node)};"]
        if isinstance(kind, Several):
            self.layouts[name] = None
        text = found.text if isinstance(kind, Rows) else self.given(found, kind, node)[0]
        if not here:
            return [f"{pad}{self.named[name]} = {text};"]
        declared = self.program.declared(kind, self.named[name], rows_const=True)
        const = "const " if once and not isinstance(kind, Rows) else ""
        return [f"{pad}{const}{declared} = {text};"]

    def _do_augassign(self, node: ast.AugAssign, depth: int) -> list[str]:
        value = self.read(ast.copy_location(
            ast.BinOp(_loaded(node.target), node.op, node.value), node))  # fmt: skip
        simple = {ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*=", ast.Div: "/="}
        if isinstance(node.target, ast.Subscript):
            return [INDENT * depth + self._stored(node.target, value)]
        if not isinstance(node.target, ast.Name):
            self.refuse(node, ast.unparse(node))
        name = node.target.id
        lines = self._set(name, value, node, depth)
        if (type(node.op) in simple and self.kinds[name] is value.kind is not WHOLE) or (
            self.kinds[name] is WHOLE and type(node.op) in (ast.Add, ast.Sub)
        ):
            other = self.read(node.value)
            sign = simple[type(node.op)]
            lines = [f"{INDENT * depth}{self.named[name]} {sign} {other.text};"]
        return lines

    def _do_if(self, node: ast.If, depth: int, word: str = "if") -> list[str]:
        pad = INDENT * depth
        test = self.number(node.test)
        if test.value is not None:
            return self._flat(node.body if test.value else node.orelse, depth, word)
        before, self.before = self.before, []
        lines = [f"{pad}{word} ({test.text}) {{", *self._block(node.body, depth + 1)]
        if node.orelse:
            further, behind = node.orelse[0], (node.body[-1].end_lineno or 0) + 1
            alone = len(node.orelse) == 1
            if alone and isinstance(further, ast.If) and self._undecided(further):
                lines += self._comments(behind, _behind_head(further), INDENT * (depth + 1))
                with self.perhaps():
                    nested = self._do_if(further, depth, "} else if")
                self.before = before
                return lines + nested
            lines += self._comments(behind, further.lineno, INDENT * (depth + 1))
            lines += [f"{pad}}} else {{", *self._block(node.orelse, depth + 1)]
        self.before = before
        return [*lines, f"{pad}}}"]

    def _undecided(self, node: ast.If) -> bool:
        with self.perhaps():
            return self.number(node.test).value is None

    def _flat(self, block: list[ast.stmt], depth: int, word: str) -> list[str]:
        before = self.before
        lines = self._block(block, depth) if block else []
        self.before = before
        return lines

    def _do_while(self, node: ast.While, depth: int) -> list[str]:
        pad = INDENT * depth
        with self.perhaps():
            test = self.number(node.test)
        if node.orelse:
            self.refuse(node, "else of a loop")
        before, self.before = self.before, []
        lines = [f"{pad}while ({test.text}) {{", *self._block(node.body, depth + 1), f"{pad}}}"]
        self.before = before
        return lines

    def _do_for(self, node: ast.For, depth: int) -> list[str]:
        pad, around = INDENT * depth, node.iter
        fine = (
            isinstance(around, ast.Call)
            and isinstance(around.func, ast.Name)
            and around.func.id == "range"
            and isinstance(node.target, ast.Name)
            and not node.orelse
        )
        if not fine:
            self.refuse(node, f"for over {ast.unparse(around)}", "for NAME in range(...)")
        assert isinstance(around, ast.Call) and isinstance(node.target, ast.Name)
        bounds = [self.number(each) for each in around.args]
        if any(each.kind is not WHOLE for each in bounds):
            self.refuse(node, ast.unparse(around), "whole numbers")
        stop = bounds[0] if len(bounds) == 1 else bounds[1]
        name = node.target.id
        turned = self.fresh("turn") if name == "_" else legal(name)
        self.kinds[name], self.named[name] = WHOLE, turned
        change = self._change(around, bounds, turned)
        first = "0" if len(bounds) == 1 else bounds[0].text
        if any(name in targets(each) for each in ast.walk(node) if isinstance(each, ast.stmt)):
            self.refuse(node, f"{name} set within its loop")
        set_here = {
            n for each in ast.walk(node) if isinstance(each, ast.stmt) for n in targets(each)
        }
        used = {each.id for each in ast.walk(around) if isinstance(each, ast.Name)}
        end = stop
        if used & set_here and stop.value is None:
            end = self.kept(stop, "end")
        whole, compare = self.program.whole, ">" if "-" in change else "<"
        head = f"for ({whole} {turned} = {first}; {turned} {compare} {end.within(11)}; {change})"
        before, self.before = self.before, []
        lines = [f"{pad}{head} {{", *self._block(node.body, depth + 1), f"{pad}}}"]
        self.before = before
        return lines

    def _change(self, node: ast.Call, bounds: list[Expr], name: str) -> str:
        if len(bounds) < 3:
            return f"{name}++"
        step = self._whole(node.args[2])
        if not step:
            self.refuse(node, ast.unparse(node), "a constant step, not 0")
        assert step is not None
        return f"{name} += {step}" if step > 0 else f"{name} -= {-step}"

    def _do_return(self, node: ast.Return, depth: int) -> list[str]:
        pad = INDENT * depth
        if node.value is None:
            return [f"{pad}return;"]
        found = self.read(node.value)
        kind = found.kind if self._result is None else kinds.joined(self._result, found.kind)
        if kind is None:
            self.refuse(node, f"{found.kind} beside {self._result}", "results of one type")
        self._result = kind
        if isinstance(kind, Several) and isinstance(node.value, ast.Tuple) and not self.returned:
            self.returned = [n.id if isinstance(n, ast.Name) else "" for n in node.value.elts]
        target = kind if self.result is None else kinds.joined(kind, self.result) or kind
        layout = self if isinstance(kind, Several) else None
        if isinstance(kind, Several) and found.items is None and found.layout is not self:
            found = found._replace(items=self.items(found, "found"))
        text, _ = self.given(found, target, node, layout)
        return [f"{pad}return {text};"]


def _behind_head(node: ast.stmt) -> int:
    """The line behind a statement, or behind the head of one that holds others."""
    inner = getattr(node, "body", None)
    return int(inner[0].lineno) if inner else (node.end_lineno or node.lineno) + 1


def _loaded(node: ast.expr) -> ast.expr:
    """A target as an expression to read."""
    found: ast.expr = ast.parse(ast.unparse(node), mode="eval").body
    return ast.copy_location(found, node)
