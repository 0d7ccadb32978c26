"""The reference: each public name once, by its home."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections import Counter
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

from macromicro.plant.encoder import Encoder
from tests import public_names
from website import docstrings, pages


def test_a_name_is_shown_once() -> None:
    """At the front door of its package or in its module: pages leave it out in the other place."""
    left_out: dict[str, set[str]] = {}
    whole = re.compile(r"automodule:: (\S+)\n   :members:(?:\n   :exclude-members: (.*))?")
    apart: list[str] = []
    for page in public_names.REFERENCE.glob("*.rst"):
        text = page.read_text(encoding="utf-8")
        left_out |= {module: set(names.split(", ")) for module, names in whole.findall(text)}
        apart += re.findall(r"autoclass:: (\S+)", text)
    assert left_out.keys() == public_names.shown()
    named = [each for module in left_out for each in public_names.public(module)]
    homes = Counter(
        each.home
        for each in named
        if each.name in apart or each.name.rpartition(".")[2] not in left_out[_module(each.name)]
    )
    assert homes == Counter({each.home for each in named})


def _module(name: str) -> str:
    return name.rpartition(".")[0]


def test_parameters_are_listed_with_unit_and_meaning() -> None:
    lines = docstrings.fields(Encoder)
    k = next(k for k, line in enumerate(lines) if line.startswith("``pitch``"))
    assert lines[k].endswith(" um") and lines[k + 1].startswith("    ") and "(" in lines[k + 1]
    assert docstrings.fields(tuple) == []


def test_docstrings_mean_what_they_say() -> None:
    """No list that begins at V, no substitution of |v|, no type torn apart."""
    assert docstrings.escaped("    V.") == "    \\V."
    assert docstrings.escaped("with |v| above 0") == "with \\|v\\| above 0"
    assert docstrings.escaped("p : int | None") == "p : int | None"
    assert docstrings.escaped("some `Recording`s") == "some `Recording`\\ s"
    assert docstrings.escaped("``|x|``") == "``|x|``"
    assert docstrings.literal(["As:", "", "    a = 1"]) == ["As:", "", "::", "", "    a = 1"]


def test_the_extra_of_the_documents_has_what_the_reference_imports() -> None:
    """`make site` installs the extra `docs` alone, in a fresh environment."""
    has = _installed("macromicro", {"docs"})
    owners = metadata.packages_distributions()
    assert {"numpy", "ophyd", "ophyd-async"} <= has
    for module in _within(public_names.shown()):
        for name in _imported(module):
            top = name.partition(".")[0]
            if top in sys.stdlib_module_names or top == "macromicro":
                continue
            homes = {plain(owner) for owner in owners[top]}
            assert homes & has, f"{module} imports {name}"


def _installed(name: str, extras: set[str]) -> set[str]:
    """A distribution of this project or another, and all that it requires with some extras."""
    found: set[str] = set()
    left = [(name, frozenset(extras))]
    seen: set[tuple[str, frozenset[str]]] = set()
    while left:
        each = left.pop()
        if each in seen:
            continue
        seen.add(each)
        found.add(each[0])
        for line in _required(each[0]):
            one = Requirement(line)
            marks = [{"extra": extra} for extra in each[1] or {""}]
            if one.marker is None or any(one.marker.evaluate(mark) for mark in marks):
                left.append((plain(one.name), frozenset(one.extras)))
    return found


def _required(name: str) -> list[str]:
    if name != "macromicro":
        try:
            return metadata.requires(name) or []
        except metadata.PackageNotFoundError:  # Sphinx, where only the tests are installed
            return []
    project = tomllib.loads((pages.ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    several = project["optional-dependencies"].items()
    named = [f'{each}; extra == "{extra}"' for extra, needs in several for each in needs]
    return [*project["dependencies"], *named]


def _within(modules: set[str]) -> set[str]:
    """Modules and those of the package that they import as they are imported."""
    found: set[str] = set()
    left = set(modules)
    while left:
        module = left.pop()
        found.add(module)
        own = {name for name in _imported(module) if name.startswith("macromicro.")}
        left |= {name for name in own if _source(name) is not None} - found
    return found


def _source(module: str) -> Path | None:
    place = pages.ROOT / "src" / Path(*module.split("."))
    for path in (place.with_suffix(".py"), place / "__init__.py"):
        if path.exists():
            return path
    return None


def _imported(module: str) -> set[str]:
    """What a module imports as it is imported: not for type checkers, and not in functions."""
    path = _source(module)
    assert path is not None
    found: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.module is not None
            found |= {node.module, *(f"{node.module}.{each.name}" for each in node.names)}
    return found


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
