"""Single mutations of a source file: a sign, a dropped term, a dropped latch, a unit.

Each is a small change that an engineer could make by mistake, and that a test beside the
file should notice. Documentation, annotations, messages and imports are left alone; so are
tables of data, and slack of at most a millionth, which a comparison of floats does as well
without.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from typing import NamedTuple


class Mutant(NamedTuple):
    """One change: line number, kind, the changed source lines before and after, whole text."""

    line: int
    kind: str
    before: str
    after: str
    text: str


_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}
_NEGATED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
_DECLARING = ("Par", "_own", "Annotated")  # a default beside them is data, its source printed
_SWAPPED = {"min": "max", "max": "min", "any": "all", "all": "any", "floor": "ceil"}


_SLACK = 1e-6
_SLACK_NAMES = ("TICK",)  # constants that are such slack


def _slack(node: ast.AST) -> bool:
    if isinstance(node, ast.Name) and node.id in _SLACK_NAMES:
        return True
    return isinstance(node, ast.Constant) and _number(node) and 0.0 < abs(node.value) <= _SLACK


def _number(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Constant)
        and isinstance(node.value, int | float)
        and not isinstance(node.value, bool)
    )


def _texts(node: ast.AST) -> bool:
    """Does an expression build text? Its arithmetic is no arithmetic."""
    return any(
        isinstance(part, ast.JoinedStr)
        or (isinstance(part, ast.Constant) and isinstance(part.value, str))
        for part in ast.walk(node)
    )


def _arithmetic(node: ast.BinOp) -> Iterator[tuple[str, ast.AST]]:
    if _slack(node.right):
        return
    if type(node.op) in _ARITHMETIC:
        yield "operator", ast.BinOp(node.left, _ARITHMETIC[type(node.op)](), node.right)
    if isinstance(node.op, ast.Add | ast.Sub):
        yield "dropped term", node.left
    if isinstance(node.op, ast.Mult | ast.Div):
        yield "dropped factor", node.left


def _other_number(value: float) -> ast.Constant:
    """A count one off, a quantity in another unit, a zero that is none."""
    if isinstance(value, int):
        return ast.Constant(value + 1)
    return ast.Constant(value * 1e3 if value else 1.0)


def replacements(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """What a node may be replaced by: kind of the mutation and the new node."""
    match node:
        case ast.BinOp() if not _texts(node):
            yield from _arithmetic(node)
        case ast.UnaryOp(op=ast.USub(), operand=operand) if not _number(operand):
            yield "sign", operand
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield "negation", operand
        case ast.Compare(left=left, ops=[op], comparators=others) if type(op) in _NEGATED:
            yield "comparison", ast.Compare(left, [_NEGATED[type(op)]()], others)
        case ast.BoolOp(op=op, values=values):
            for k in range(len(values)):
                kept = values[:k] + values[k + 1 :]
                new = kept[0] if len(kept) == 1 else ast.BoolOp(op, kept)
                yield "dropped condition", new
        case ast.Call(func=ast.Name(id=name), args=args, keywords=more) if name in _SWAPPED:
            yield "bound", ast.Call(ast.Name(_SWAPPED[name], ast.Load()), args, more)
        case ast.Call(func=ast.Name(id="abs"), args=[inside]):
            yield "sign", inside
        case ast.Constant(value=value) if _number(node) and not _slack(node):
            yield "number", _other_number(value)


def _left_alone(tree: ast.Module) -> set[ast.AST]:
    """Nodes that no mutation may touch: annotations, texts, raised errors, imports, defaults of
    declared parameters (their `Par` is documentation)."""
    alone: set[ast.AST] = set()
    for statement in tree.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None:
            tables = (
                n
                for n in ast.walk(statement.value)
                if isinstance(n, ast.Tuple | ast.List | ast.Dict)
            )
            alone.update(part for table in tables for part in ast.walk(table))
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        match node:
            case ast.AnnAssign(annotation=annotation, value=value):
                declared = any(
                    isinstance(n, ast.Name) and n.id in _DECLARING for n in ast.walk(annotation)
                )
                parts = [annotation, value if declared else None]
            case ast.FunctionDef(args=args, returns=returns, decorator_list=decorators):
                given = [*args.posonlyargs, *args.args, *args.kwonlyargs]
                parts = [returns, *decorators, *(a.annotation for a in given)]
            case ast.Raise() | ast.JoinedStr() | ast.Assert() | ast.Import() | ast.ImportFrom():
                parts = [node]
            case ast.If(test=ast.Name(id="TYPE_CHECKING")):
                parts = [node]
            case ast.Subscript(value=ast.Name(id="dict" | "tuple" | "list" | "Callable")):
                parts = [node]
        for part in parts:
            if part is not None:
                alone.update(ast.walk(part))
    return alone


def _latches(tree: ast.Module) -> Iterator[ast.stmt]:
    """Assignments without which an older value of the same name would stay."""
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        known = {a.arg for a in (*function.args.args, *function.args.kwonlyargs)}
        statements = [n for n in ast.walk(function) if isinstance(n, ast.Assign | ast.AugAssign)]
        for statement in sorted(statements, key=lambda n: n.lineno):
            if isinstance(statement, ast.AugAssign):
                yield statement
                continue
            targets = [n for t in statement.targets for n in ast.walk(t)]
            names = {n.id for n in targets if isinstance(n, ast.Name)}
            if names and names <= known:
                yield statement
            known |= names


def _lines(text: str, node: ast.AST) -> str:
    first, last = node.lineno - 1, node.end_lineno or node.lineno  # type: ignore[attr-defined]
    return "\n".join(line.strip() for line in text.splitlines()[first:last])


def _spliced(text: str, node: ast.AST, new: str) -> str:
    """`text` with the source of `node` replaced by `new`."""
    lines = text.splitlines(keepends=True)
    first, last = node.lineno - 1, node.end_lineno - 1  # type: ignore[attr-defined]
    head = lines[first].encode()[: node.col_offset].decode()  # type: ignore[attr-defined]
    tail = lines[last].encode()[node.end_col_offset :].decode()  # type: ignore[attr-defined]
    return "".join([*lines[:first], head + new + tail, *lines[last + 1 :]])


def mutants(text: str) -> list[Mutant]:
    """All single mutants of a source text, in the order of its lines."""
    tree = ast.parse(text)
    alone = _left_alone(tree)
    found = []
    for node in ast.walk(tree):
        if node in alone:
            continue
        for kind, new in replacements(node):
            whole = _spliced(text, node, f"({ast.unparse(copy.deepcopy(new))})")
            found.append(_mutant(text, whole, node, kind))
    for statement in _latches(tree):
        if statement not in alone:
            whole = _spliced(text, statement, "pass")
            found.append(_mutant(text, whole, statement, "dropped assignment"))
    unique = {m.text: m for m in found if _differs(text, m.text)}
    return sorted(unique.values(), key=lambda m: (m.line, m.kind, m.after))


def _mutant(text: str, whole: str, node: ast.AST, kind: str) -> Mutant:
    before = _lines(text, node)
    first = node.lineno - 1  # type: ignore[attr-defined]
    spared = len(text.splitlines()) - (node.end_lineno or 0)  # type: ignore[attr-defined]
    after = whole.splitlines()[first : len(whole.splitlines()) - spared]
    return Mutant(first + 1, kind, before, "\n".join(line.strip() for line in after), whole)


def _differs(text: str, other: str) -> bool:
    """Is it another program, and one that Python reads?"""
    try:
        return ast.dump(ast.parse(text)) != ast.dump(ast.parse(other))
    except SyntaxError:
        return False
