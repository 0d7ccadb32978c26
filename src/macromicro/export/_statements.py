"""A kernel as a function in C, statement by statement."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.export import kinds
from macromicro.export._expressions import Expressions
from macromicro.export._reading import Expr, Level
from macromicro.export._sources import Source
from macromicro.export._text import legal
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty

if TYPE_CHECKING:
    from macromicro.export._program import Program

INDENT = "    "


class Uses(NamedTuple):
    """The variables of a kernel, known before any C is written."""

    stores: Counter[str]  # how often each is set
    loads: Counter[str]  # how often each is read
    outer: list[str]  # those declared at the top, as some use is outside the block that sets it


class Routine(Expressions):
    def __init__(
        self, program: Program, source: Source, types: tuple[Kind, ...], name: str
    ) -> None:
        super().__init__(program, source)
        self.name = name
        self.parameters = dict(zip(source.parameters, types, strict=True))
        self.result: Any = None  # type of what it returns, as the last reading found it
        self.returned: list[str] = []  # names in its first `return`
        self.lines: list[str] = []
        self.uses = _uses(source.body, source.parameters)
        self.local = set(source.parameters) | {n for n, k in self.uses.stores.items() if k}

    def translate(self) -> None:
        """Find all types, then write the lines."""
        found: dict[str, Kind] = {}
        for _ in range(10):
            begun = self._begin(found)
            lines = [*begun, *self._block(self.source.body, 1)]
            if self.kinds == found and self._result == self.result:
                self.lines = lines
                return
            found, self.result = dict(self.kinds), self._result
        self.refuse(self.source.node, self.name, "variables that keep their types")

    def _begin(self, found: dict[str, Kind]) -> list[str]:
        """Forget all but the types; the declarations at the top."""
        self.kinds = {**found, **self.parameters}
        self.taken = {legal(name) for name in self.local}
        self.named = {name: legal(name) for name in self.local}
        self.steady = {n for n in self.parameters if not self.uses.stores[n]}
        self._declared = set(self.uses.outer)
        self._result: Any = None
        lines = []
        for name, kind in self.parameters.items():
            if isinstance(kind, Struct | Several) and not empty(kind):
                self.named[name] = f"(*{legal(name)})"
                if self.uses.stores[name]:
                    self.named[name] = legal(name)
                    declared = self.program.declared(kind, legal(name))
                    lines.append(f"{INDENT}{declared} = *given_{name};")
        for name in self.uses.outer:
            kind = found.get(name, Several(()))  # not known in the first reading
            if not empty(kind):
                start = ""
                if isinstance(kind, kinds.Scalar):
                    start = {REAL: " = 0.0", WHOLE: " = 0", TRUTH: " = false"}[kind]
                lines.append(f"{INDENT}{self.program.declared(kind, legal(name))}{start};")
        return lines

    def heads(self) -> list[tuple[str, Kind, str]]:
        """Parameters in C: name in Python, type, name in C."""
        found = []
        for name, kind in self.parameters.items():
            copied = self.uses.stores[name] and isinstance(kind, Struct | Several)
            if not empty(kind):
                found.append((name, kind, f"given_{name}" if copied else legal(name)))
        return found

    # Blocks

    def _block(self, block: list[ast.stmt], depth: int) -> list[str]:
        lines: list[str] = []
        depends, self.depends = self.depends, 0
        last, pad = block[0].lineno, INDENT * depth
        for node in block:
            self.before = []
            self.statement, self.called, self.changing = node, 0, False
            lines += self._comments(last, _behind_head(node), pad)
            last = (node.end_lineno or node.lineno) + 1
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

    def _inner(self, head: str, block: list[ast.stmt], depth: int) -> list[str]:
        """A block in braces; what its head needs stays before it."""
        before = self.before
        lines = [f"{INDENT * depth}{head} {{", *self._block(block, depth + 1)]
        self.before = before
        return lines

    def _do_if(self, node: ast.If, depth: int, word: str = "if") -> list[str]:
        test = self.number(node.test)
        if test.value is not None:
            before, chosen = self.before, node.body if test.value else node.orelse
            lines = self._block(chosen, depth) if chosen else []
            self.before = before
            return lines
        lines = self._inner(f"{word} ({test.text})", node.body, depth)
        if node.orelse:
            further, behind = node.orelse[0], (node.body[-1].end_lineno or 0) + 1
            if isinstance(further, ast.If) and len(node.orelse) == 1 and self._undecided(further):
                lines += self._comments(behind, _behind_head(further), INDENT * (depth + 1))
                with self.perhaps():
                    return lines + self._do_if(further, depth, "} else if")
            lines += self._comments(behind, further.lineno, INDENT * (depth + 1))
            lines += self._inner("} else", node.orelse, depth)
        return [*lines, f"{INDENT * depth}}}"]

    def _undecided(self, node: ast.If) -> bool:
        with self.perhaps():
            return self.number(node.test).value is None

    def _do_while(self, node: ast.While, depth: int) -> list[str]:
        with self.perhaps():
            test = self.number(node.test)
        if node.orelse:
            self.refuse(node, "else of a loop")
        return [*self._inner(f"while ({test.text})", node.body, depth), f"{INDENT * depth}}}"]

    def _do_for(self, node: ast.For, depth: int) -> list[str]:
        around, target = node.iter, node.target
        if not (
            isinstance(around, ast.Call)
            and isinstance(around.func, ast.Name)
            and around.func.id == "range"
            and isinstance(target, ast.Name)
            and not node.orelse
        ):
            self.refuse(node, f"for over {ast.unparse(around)}", "for NAME in range(...)")
        bounds = [self.number(each) for each in around.args]
        if any(each.kind is not WHOLE for each in bounds):
            self.refuse(node, ast.unparse(around), "whole numbers")
        set_here = {each.id for each in _names(node.body) if isinstance(each.ctx, ast.Store)}
        if target.id in set_here - {"_"}:
            self.refuse(node, f"{target.id} set within its loop")
        turned = self.fresh("turn") if target.id == "_" else legal(target.id)
        self.kinds[target.id], self.named[target.id] = WHOLE, turned
        change = self._change(around, bounds, turned)
        first = "0" if len(bounds) == 1 else bounds[0].text
        end = bounds[0] if len(bounds) == 1 else bounds[1]
        if {each.id for each in _names([around])} & set_here and end.value is None:
            end = self.kept(end, "end")
        compare, last = ">" if "-" in change else "<", end.within(Level.LESS + 1)
        head = f"{self.program.whole} {turned} = {first}; {turned} {compare} {last}"
        return [*self._inner(f"for ({head}; {change})", node.body, depth), f"{INDENT * depth}}}"]

    def _change(self, node: ast.Call, bounds: list[Expr], name: str) -> str:
        if len(bounds) < 3:
            return f"{name}++"
        step = self._whole(node.args[2])
        if not step:
            self.refuse(node, ast.unparse(node), "a constant step, not 0")
        return f"{name} += {step}" if step > 0 else f"{name} -= {-step}"

    # Assignments

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

    def _do_annassign(self, node: ast.AnnAssign, depth: int) -> list[str]:
        if node.value is None or not isinstance(node.target, ast.Name):
            self.refuse(node, ast.unparse(node))
        return self._set(node.target.id, self.read(node.value), node, depth)

    def _do_augassign(self, node: ast.AugAssign, depth: int) -> list[str]:
        target = ast.copy_location(ast.parse(ast.unparse(node.target), mode="eval").body, node)
        value = self.read(ast.copy_location(ast.BinOp(target, node.op, node.value), node))
        if isinstance(node.target, ast.Subscript):
            return [INDENT * depth + self._stored(node.target, value)]
        if not isinstance(node.target, ast.Name):
            self.refuse(node, ast.unparse(node))
        return self._set(node.target.id, value, node, depth)

    def _stored(self, target: ast.Subscript, found: Expr) -> str:
        place = self.read(target)
        if not isinstance(self.read(target.value).kind, Rows):
            self.refuse(target, ast.unparse(target), "an item of an array")
        self.writes(target.value)
        self.mutates = True
        return f"{place.text} = {found.text};"

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
        if not items and not any(self.uses.loads[each] for each in names) and called is not None:
            return [f"{INDENT * depth}{whole.text};"]
        found = list(self.items(whole, f"{name}_out"))
        if isinstance(node.value, ast.Tuple):
            self._apart(names, node.value.elts, found)
        lines = []
        for each, name, value in zip(target.elts, names, found, strict=True):
            if isinstance(each, ast.Subscript):
                lines.append(INDENT * depth + self._stored(each, value))
            elif self.uses.loads[name]:
                lines += self._set(name, value, node, depth)
        return lines

    def _apart(self, names: list[str], nodes: list[ast.expr], found: list[Expr]) -> None:
        """Keep values that a later assignment of the same statement would read."""
        if any(isinstance(each, ast.Starred) for each in nodes):
            return
        for place, node in enumerate(nodes):
            read = {each.id for each in _names([node])}
            if read & set(names[:place]) and found[place].items is None:
                kept = self.kept(found[place], f"new_{names[place]}")
                found[place] = kept._replace(stable=False)

    def _set(self, name: str, found: Expr, node: ast.stmt, depth: int) -> list[str]:
        pad = INDENT * depth
        kind = self.kinds.get(name, found.kind)
        if name not in self.parameters:
            kind = kinds.join(kind, found.kind)
        if kind is None:
            self.refuse(
                node, f"{name}, {self.kinds[name]} and {found.kind}", "one type for each variable"
            )
        self.kinds[name] = kind
        here = name not in self._declared and name not in self.parameters
        self._declared.add(name)
        unread = not self.uses.loads[name] and not found.place and "(" not in found.text
        if empty(kind) or unread:
            return []
        once = here and self.uses.stores[name] == 1
        if once:
            self.steady.add(name)
            if found.stable and isinstance(kind, Struct) and found.place:
                to = self.program.declared(kind, f"*{self.named[name]}")
                self.named[name] = f"(*{self.named[name]})"
                return [f"{pad}const {to} = {self.address(found, node)};"]
        text = found.text if isinstance(kind, Rows) else self.given(found, kind, node)[0]
        shown = self.named[name]
        if here:
            shown = self.program.declared(kind, shown, rows_const=True)
        const = "const " if once and not isinstance(kind, Rows) else ""
        return [f"{pad}{const}{shown} = {text};"]

    # Other statements

    def _do_expr(self, node: ast.Expr, depth: int) -> list[str]:
        if isinstance(node.value, ast.Constant):
            return []
        if not isinstance(node.value, ast.Call):
            self.refuse(node, ast.unparse(node))
        return [f"{INDENT * depth}{self.read(node.value).text};"]

    def _do_pass(self, node: ast.Pass, depth: int) -> list[str]:
        return []

    def _do_break(self, node: ast.Break | ast.Continue, depth: int) -> list[str]:
        return [f"{INDENT * depth}{type(node).__name__.lower()};"]

    _do_continue = _do_break

    def _do_return(self, node: ast.Return, depth: int) -> list[str]:
        pad = INDENT * depth
        if node.value is None:
            return [f"{pad}return;"]
        found = self.read(node.value)
        kind = found.kind if self._result is None else kinds.join(self._result, found.kind)
        if kind is None:
            self.refuse(node, f"{found.kind} beside {self._result}", "results of one type")
        self._result = kind
        if isinstance(kind, Several) and isinstance(node.value, ast.Tuple) and not self.returned:
            self.returned = [n.id if isinstance(n, ast.Name) else "" for n in node.value.elts]
        target = kind if self.result is None else kinds.join(kind, self.result) or kind
        if isinstance(kind, Several) and found.items is None and found.layout is not self:
            found = found._replace(items=self.items(found, "found"))
        text, _ = self.given(found, target, node, self)
        return [f"{pad}return {text};"]


def _behind_head(node: ast.stmt) -> int:
    """The line behind a statement, or behind the head of one that holds others."""
    inner = getattr(node, "body", None)
    return int(inner[0].lineno) if inner else (node.end_lineno or node.lineno) + 1


def _names(nodes: Iterable[ast.AST]) -> list[ast.Name]:
    return [each for node in nodes for each in ast.walk(node) if isinstance(each, ast.Name)]


def _targets(node: ast.AST) -> list[str]:
    """Variables that an assignment sets."""
    found: list[ast.expr] = [node.target] if isinstance(node, ast.AnnAssign) else []
    if isinstance(node, ast.Assign):
        found = [p for t in node.targets for p in (t.elts if isinstance(t, ast.Tuple) else [t])]
    return [part.id for part in found if isinstance(part, ast.Name)]


def _uses(body: list[ast.stmt], parameters: list[str]) -> Uses:
    every = Counter(each.id for each in _names(body))
    stores = Counter(each.id for each in _names(body) if isinstance(each.ctx, ast.Store))
    loads = every - stores
    seen, outer = set(parameters), []
    for node in [each for statement in body for each in ast.walk(statement)]:
        if isinstance(node, ast.AugAssign):
            loads.update(each.id for each in _names([node.target]))
        if isinstance(node, ast.For):
            seen.update(each.id for each in _names([node.target]))  # the head declares it

    def walk(block: list[ast.stmt]) -> None:
        for place, node in enumerate(block):
            inside = Counter(each.id for each in _names(block[place:]))
            for name in _targets(node):
                if name not in seen and inside[name] < every[name]:
                    outer.append(name)
                seen.add(name)
            for inner in (getattr(node, "body", []), getattr(node, "orelse", [])):
                walk(inner)

    walk(body)
    return Uses(stores, loads, outer)
