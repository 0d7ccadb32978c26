"""Docstrings of public functions name every parameter, the result and the errors raised.

ruff checks that sections are well formed and name nothing that is not there; it does not ask for
a section that is missing, which this does. (numpydoc's own checker asks it of properties too,
overlooks a `yield` within a loop, and brings Sphinx with it.)
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import pytest

import macromicro

PACKAGE = Path(macromicro.__file__).parent
PROJECT = Path(__file__).parents[1] / "pyproject.toml"
LISTED = tomllib.loads(PROJECT.read_text())["tool"]["docstrings"]
FILES = sorted(place.relative_to(PACKAGE).as_posix() for place in PACKAGE.rglob("*.py"))
TREES = {name: ast.parse((PACKAGE / name).read_text()) for name in FILES}
ALONE = LISTED["help"] + LISTED["internal"]
Function = ast.FunctionDef | ast.AsyncFunctionDef
# Decorated so, a function is read like a value, or says nothing of its own.
VALUES = ("property", "cached_property", "overload", "setter")


def in_room(name: str, rooms: list[str]) -> bool:
    """Whether a file belongs to one of `rooms`: a folder, or files of the package's root."""
    return any(
        name.startswith(f"{room}/") or ("/" not in name and fnmatch(name, room)) for room in rooms
    )


def public(node: ast.AST, within: str = "") -> Iterator[tuple[str, Function]]:
    """Public functions and methods, by qualified name; not those within functions."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ClassDef) and not child.name.startswith("_"):
            yield from public(child, f"{within}{child.name}.")
        elif isinstance(child, Function):
            worn = [re.split(r"[.(]", ast.unparse(d))[-1] for d in child.decorator_list]
            if not child.name.startswith("_") and not set(worn) & set(VALUES):
                yield within + child.name, child


def taken(function: Function) -> list[str]:
    """The names of a function's parameters, in order."""
    given = function.args
    names = [each.arg for each in (*given.posonlyargs, *given.args)]
    names = names[1:] if names[:1] in (["self"], ["cls"]) else names
    names += [f"*{given.vararg.arg}"] if given.vararg else []
    names += [each.arg for each in given.kwonlyargs]
    return names + ([f"**{given.kwarg.arg}"] if given.kwarg else [])


def own(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a function's body without those of functions within it."""
    for child in ast.iter_child_nodes(node):
        yield child
        if not isinstance(child, Function | ast.Lambda | ast.ClassDef):
            yield from own(child)


def gives(function: Function) -> str:
    """The section that its result needs: "Returns", "Yields", or "" if it gives nothing."""
    if any(isinstance(each, ast.Yield | ast.YieldFrom) for each in own(function)):
        return "Yields"
    result = "None" if function.returns is None else ast.unparse(function.returns)
    return "" if result in ("None", "NoReturn", "Never") else "Returns"


def raised(node: ast.AST) -> set[str]:
    """The classes of the errors that its own statements raise by name, and do not catch."""
    found: set[str] = set()
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Raise) and child.exc:
            error = child.exc.func if isinstance(child.exc, ast.Call) else child.exc
            name = ast.unparse(error).split(".")[-1]
            found |= {name} if name[0].isupper() else set()
        elif not isinstance(child, Function | ast.Lambda | ast.ClassDef):
            found |= raised(child)
    if isinstance(node, ast.Try):
        types = [ast.unparse(each.type) for each in node.handlers if each.type]
        caught = {name for text in types for name in re.findall(r"\w+", text)}
        found -= caught & set().union(*(raised(each) for each in node.body))
    return found


def sections(text: str) -> dict[str, list[str]]:
    """The sections of a docstring: for each title the heads of its entries."""
    pieces = re.split(r"^(\w[\w ]*)\n-{3,}$", text, flags=re.MULTILINE)
    return {
        title: [line for line in body.splitlines() if line[:1].strip()]
        for title, body in zip(pieces[1::2], pieces[2::2], strict=True)
    }


def wrong(function: Function) -> list[str]:
    """What is missing in the docstring of a public function."""
    found = sections(ast.get_docstring(function) or "")
    heads = [head.split(" :")[0] for head in found.get("Parameters", [])]
    named = [name for head in heads for name in head.split(", ")]
    given, result = taken(function), gives(function)
    problems = [] if named == given else [f"Parameters {named}, but it takes {given}"]
    if result and not found.get(result):
        problems.append(f"no {result}")
    missing = raised(function) - {head.split(" :")[0] for head in found.get("Raises", [])}
    return problems + [f"Raises lacks {name}" for name in sorted(missing)]


@pytest.mark.parametrize("name", [n for n in FILES if not in_room(n, ALONE)])
def test_a_public_function_says_what_it_takes_gives_and_raises(name: str) -> None:
    found = {title: wrong(f) for title, f in public(TREES[name])}
    assert {title: problems for title, problems in found.items() if problems} == {}


@pytest.mark.parametrize("name", [n for n in FILES if in_room(n, LISTED["internal"])])
def test_an_internal_function_names_the_errors_that_it_raises(name: str) -> None:
    texts = [(q, raised(f), ast.get_docstring(f) or "") for q, f in public(TREES[name])]
    silent = {q: [e for e in errors if e not in text] for q, errors, text in texts}
    assert {q: errors for q, errors in silent.items() if errors} == {}


def test_what_is_left_alone_exists() -> None:
    assert [room for room in ALONE if not any(in_room(name, [room]) for name in FILES)] == []


HALF = '''
class Thing:
    """A thing."""

    @property
    def width(self) -> float:
        """Width [m]."""

    def each(self, first: int, *more: int, scale: float = 1.0) -> Iterator[float]:
        """Each number.

        Parameters
        ----------
        first, *more : int
            Numbers.
        """
        if first < 0:
            raise ValueError(first)
        for number in (first, *more):
            yield number * scale
'''


def test_what_is_missing_is_named() -> None:
    ((name, function),) = public(ast.parse(HALF))
    assert name == "Thing.each"
    assert wrong(function) == [
        "Parameters ['first', '*more'], but it takes ['first', '*more', 'scale']",
        "no Yields",
        "Raises lacks ValueError",
    ]
