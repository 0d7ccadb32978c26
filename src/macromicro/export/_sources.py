"""The source of a kernel: its tree, its lines, and the meaning of its names."""

from __future__ import annotations

import ast
import builtins
import inspect
import textwrap
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NoReturn, get_args, get_origin

from macromicro.columns import Meaning, meaning
from macromicro.errors import InputError
from macromicro.export.kinds import hints_of


class Unknown(Exception):
    """A name that is not a constant."""


class Source:
    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self.file = Path(function.__code__.co_filename)
        try:
            lines, first = inspect.getsourcelines(function)
        except (OSError, TypeError):
            accepted = "a kernel whose source is a file"
            raise InputError(f"{self.file}", function.__name__, accepted) from None
        text = textwrap.dedent("".join(lines))
        self.first = max(first, 1)
        self.text = text.splitlines()
        self.parameters: list[str]
        self.body: list[ast.stmt]
        self.head: list[str] = []  # comments above the function in C
        self._read(text)
        free = inspect.getclosurevars(function)
        self.names = {**vars(builtins), **function.__globals__, **free.nonlocals}
        self.hints = hints_of(function, noted=True)

    def _read(self, text: str) -> None:
        tree = ast.parse(text)
        names = list(inspect.signature(self.function).parameters)
        self.parameters = names
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and node.name == self.function.__name__:
                self.body = node.body
                self.node: ast.AST = node
                if ast.get_docstring(node, clean=False) and len(node.body) > 1:
                    self.body = node.body[1:]
                    self.head = self.comments(node.lineno, node.body[0].lineno + 1)
                else:
                    self.head = self.comments(node.lineno, node.body[0].lineno)
                return
            if isinstance(node, ast.Lambda) and [a.arg for a in node.args.args] == names:
                value = ast.Return(node.body)
                self.body = [ast.copy_location(value, node.body)]
                self.node = node
                return
        self.refuse(tree, "no function", "a kernel whose source is a file")

    def comments(self, first: int, end: int) -> list[str]:
        """Lines of the source, the last of them before `end`, as comments of C."""
        lines = textwrap.dedent("\n".join(self.text[first - 1 : end - 1])).splitlines()
        # A backslash at the end would make the next line of C a comment too.
        return ["// " + line.rstrip("\\ ") for line in lines if line.strip()]

    def results(self) -> list[Meaning]:
        """Meanings of each part of the result."""
        hint = self.hints.get("return")
        parts = get_args(hint) if get_origin(hint) is tuple else (hint,)
        return [meaning(part) for part in parts]

    def where(self, node: ast.AST) -> str:
        return f"{self.file}:{self.first + getattr(node, 'lineno', 1) - 1}"

    def refuse(self, node: ast.AST, found: str, accepted: str) -> NoReturn:
        raise InputError(f"{self.where(node)}, {self.function.__name__}", found, accepted)

    def constant(self, node: ast.AST, local: set[str]) -> Any:
        """The value of a constant expression; `Unknown` for any other."""
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Tuple):
            return tuple(self.constant(each, local) for each in node.elts)
        if isinstance(node, ast.Name):
            if node.id in local or node.id not in self.names:
                raise Unknown(node.id)
            return self.names[node.id]
        if isinstance(node, ast.Attribute):
            base = self.constant(node.value, local)
            if not hasattr(base, node.attr):
                raise Unknown(node.attr)
            return getattr(base, node.attr)
        raise Unknown(type(node).__name__)

    def home(self, node: ast.AST) -> str:
        """The module in which a constant's name is looked up, for its name in C."""
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            base = self.names.get(node.value.id)
            if inspect.ismodule(base):
                return base.__name__
        return str(self.function.__module__)


@cache
def source(function: Callable[..., Any]) -> Source:
    return Source(function)
