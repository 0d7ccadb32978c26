"""Where a kernel's variables are declared in C: as late as all their uses allow."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

Path = tuple[tuple[int, int], ...]  # blocks by identity, each with the statement's place in it


class Scopes(NamedTuple):
    """The variables' uses, known before any C is written."""

    # stores, loads: how often each is set and read
    stores: Counter[str]
    loads: Counter[str]
    at: dict[str, tuple[int, int]]  # block and statement where each is declared

    def bare(self, node: ast.stmt, place: tuple[int, int]) -> list[str]:
        """Variables to declare before a statement that does not set them first."""
        return [n for n, at in self.at.items() if at == place and n not in targets(node)]


def targets(node: ast.stmt) -> list[str]:
    """Variables that an assignment sets."""
    if isinstance(node, ast.Assign):
        found: list[str] = []
        for target in node.targets:
            parts = target.elts if isinstance(target, ast.Tuple) else [target]
            found += [part.id for part in parts if isinstance(part, ast.Name)]
        return found
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
        return [node.target.id]
    return []


def scopes(body: list[ast.stmt], parameters: list[str]) -> Scopes:
    uses: dict[str, list[Path]] = {}
    stores: Counter[str] = Counter()
    loads: Counter[str] = Counter()
    turns: set[str] = set()  # variables of `for`, which C declares in its head
    loops: set[int] = set()
    statements: dict[tuple[int, int], ast.stmt] = {}

    def names(node: ast.AST, path: Path) -> None:
        for each in ast.walk(node):
            if isinstance(each, ast.Name):
                uses.setdefault(each.id, []).append(path)
                (loads if isinstance(each.ctx, ast.Load) else stores)[each.id] += 1

    def walk(block: list[ast.stmt], outer: Path) -> None:
        for place, node in enumerate(block):
            statements[id(block), place] = node
            path = (*outer, (id(block), place))
            for inner in blocks(node):
                if isinstance(node, ast.For | ast.While):
                    loops.add(id(inner))
                walk(inner, path)
            if isinstance(node, ast.If | ast.While):
                names(node.test, path)
            elif isinstance(node, ast.For):
                names(node.iter, path)
                if isinstance(node.target, ast.Name):
                    turns.add(node.target.id)
                    stores[node.target.id] += 1
            else:
                names(node, path)
            if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                loads[node.target.id] += 1

    walk(body, ())
    at = {}
    for name in [n for n in uses if stores[n] and n not in parameters and n not in turns]:
        common: Path = tuple(_shared(uses[name]))
        while len(common) > 1 and common[-1][0] in loops:
            if name in targets(statements[common[-1]]):
                break
            common = common[:-1]
        at[name] = common[-1]
    return Scopes(stores, loads, at)


def blocks(node: ast.stmt) -> list[list[ast.stmt]]:
    return [b for b in (getattr(node, "body", []), getattr(node, "orelse", [])) if b]


def _shared(paths: list[Path]) -> Iterator[tuple[int, int]]:
    """The innermost block of all uses, and its first statement that holds one."""
    for level in zip(*paths, strict=False):
        if len({block for block, _ in level}) > 1:
            return
        yield level[0][0], min(place for _, place in level)
        if len({place for _, place in level}) > 1:
            return
