"""Docstrings of what users call: each parameter, the result and the errors raised, in words."""

from __future__ import annotations

import ast
import doctest
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib import import_module
from inspect import getdoc
from pathlib import Path
from typing import Any

import pytest

import macromicro
from macromicro import kernel, types
from tests import public_names

PACKAGE = Path(macromicro.__file__).parent
PROJECT = Path(__file__).parents[1] / "pyproject.toml"
PUBLIC = tomllib.loads(PROJECT.read_text())["tool"]["docstrings"]["public"]
Function = ast.FunctionDef | ast.AsyncFunctionDef
# Decorated so, a function is read like a value, or says nothing of its own.
VALUES = ("property", "cached_property", "overload", "setter")
# Decorated so, it takes what the decorator documents: see `test_methods_share_their_parameters`.
SHARED = ("_method",)
# Functions and classes without an example, by where they are defined, and why.
WITHOUT = {
    "macromicro.studies.calibrate": "runs a machine",
    "macromicro.api.run": "compiles the bench",
    "macromicro.batch.variants.Metric": "shown by `batch.job`",
    "macromicro.batch.variants.Variants": "shown by `batch.run`",
    "macromicro.columns.Layout": "shown by `columns.layout`",
    "macromicro.columns.Part": "shown by `columns.layout`",
    "macromicro.commission.procedure.Kind": "shown by `commission.procedure.perform`",
    "macromicro.commission.procedure.Work": "shown by `commission.procedure.perform`",
    "macromicro.control.stage_law.Sample": "shown by `control.stage_law.StageLaw`",
    "macromicro.control.stage_law.Target": "shown by `control.stage_law.StageLaw`",
    "macromicro.design.costs.Comparison": "shown by `design.compare`",
    "macromicro.design.extension.Cycle": "shown by `design.extension.per_cycle`",
    "macromicro.design.extension.Extension": "shown by `design.extension.extension`",
    "macromicro.design.magnets.Change": "shown by `design.largest_change`",
    "macromicro.design.margins.Crossover": "shown by `design.margins.crossovers`",
    "macromicro.design.margins.Margins": "shown by `design.margins.margins`",
    "macromicro.design.resolution.Budget": "shown by `design.budget`",
    "macromicro.design.response.MoveResult": "shown by `moves`",
    "macromicro.design.response.moves": "shown by `moves`, which takes any recording",
    "macromicro.design.vibration.Vibration": "needs a run",
    "macromicro.design.vibration.vibration": "needs a run",
    "macromicro.hysteresis.diagnostics.Deviation": "shown by `hysteresis.wiping_out`",
    "macromicro.hysteresis.forc.ForcFile": "shown by `hysteresis.forc.read_forc`",
    "macromicro.hysteresis.memory.Memory": "shown by `hysteresis.fresh`",
    "macromicro.hysteresis.prandtl.Plays": "shown by `hysteresis.prandtl.relaxed`",
    "macromicro.hysteresis.prandtl.Prandtl": "shown by `hysteresis.prandtl.operator`",
    "macromicro.hysteresis.prandtl_fit.PrandtlFit": "shown by `hysteresis.prandtl_fit.fit`",
    "macromicro.identify.axis_fit.DriveFit": "shown by `identify.drive`",
    "macromicro.identify.deadzone.DeadZone": "shown by `identify.dead_zone`",
    "macromicro.identify.deadzone.Trial": "shown by `identify.dead_zone`",
    "macromicro.identify.deadzone.Side": "shown by `identify.DiscontinuousDeadZone`",
    "macromicro.kernel.admit": "changes the process",
    "macromicro.kernel.by_type": "needs the compiler",
    "macromicro.kernel.cache_folder": "reads all sources",
    "macromicro.kernel.compiled": "compiles",
    "macromicro.machines.stage.Driven": "shown by `machines.stage.drive`",
    "macromicro.machines.stage.Loop": "made by `machines.runs.loop`",
    "macromicro.ophyd.Positioner": "needs a server",
    "macromicro.programme.moves.Programme": "shown by `programme.load`",
    "macromicro.programme.moves.Span": "shown by `programme.follow`",
    "macromicro.remote.asynchronous.AsyncMotion": "needs a server",
    "macromicro.remote.machine.Machine": "needs a server",
    "macromicro.remote.machine.Motion": "needs a server",
    "macromicro.rig.opening.open_rig": "needs a rig",
    "macromicro.studies.robust": "compiles the machine; docs/machines.md shows it",
    "macromicro.studies.sweep": "needs a file; docs/tuning.md shows it",
    "macromicro.studies.tune": "compiles the machine; docs/machines.md shows it",
    "macromicro.lab.drive.by_laser": "compiles the bench",
    "macromicro.lab.drive.closed_loop": "compiles the bench",
    "macromicro.lab.drive.heated": "compiles the bench",
    "macromicro.lab.drive.open_loop": "compiles the bench",
    "macromicro.lab.drive.drive": "compiles the bench",
    "macromicro.lab.drive.recorded": "of what `drive` gives",
    "macromicro.schema.par.Entry": "shown by `schema.par.entries`",
}


def functions(module: str) -> Iterator[tuple[str, Function]]:
    """The public functions and methods of a listed module, wherever they are defined."""
    for named in public_names.public(public_names.full(module)):
        home = sys.modules[str(_thing(named.name).__module__)]
        tree = ast.parse(Path(str(home.__file__)).read_text(encoding="utf-8"))
        name = named.home.removeprefix(f"{home.__name__}.")
        for node in tree.body:
            if getattr(node, "name", "") == name:
                yield from _public(node, named.name.rpartition(".")[0])


def _thing(name: str) -> Any:
    module, _, last = name.rpartition(".")
    return getattr(import_module(module), last)


def _public(node: ast.AST, within: str) -> Iterator[tuple[str, Function]]:
    """A function, or the public methods of a class."""
    if isinstance(node, Function):
        worn = {n for d in node.decorator_list for n in re.split(r"[.()]", ast.unparse(d))}
        if not node.name.startswith("_") and not worn & {*VALUES, *SHARED}:
            yield f"{within}.{node.name}", node
    elif isinstance(node, ast.ClassDef):
        for child in node.body:
            yield from _public(child, f"{within}.{node.name}")


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


def sections(text: str) -> dict[str, dict[str, str]]:
    """The sections of a docstring: for each title the heads of its entries with their words."""
    pieces = re.split(r"^(\w[\w ]*)\n-{3,}$", text, flags=re.MULTILINE)
    found: dict[str, dict[str, str]] = {}
    for title, body in zip(pieces[1::2], pieces[2::2], strict=True):
        entries = found.setdefault(title, {})
        for block in re.split(r"\n(?=\S)", body.strip("\n")):
            head, _, words = block.partition("\n")
            entries[head] = " ".join(words.split())
    return found


def repeats(head: str, words: str) -> bool:
    """Whether the words about a parameter say no more than its name and type."""
    said = set(re.findall(r"[a-z]{3,}", words.lower())) - {"the", "its", "this", "that"}
    known = re.findall(r"[A-Z]?[a-z]{3,}", head)
    return bool(said) and not re.search(r"[\d(\[,;]", words) and said <= set(map(str.lower, known))


def inherited(name: str) -> str:
    """The docstring of a method, or that of the method of its base that it overrides."""
    home, _, last = name.rpartition(".")
    return getdoc(getattr(sys.modules.get(home) or _thing(home), last)) or ""


def wrong(function: Function, docstring: str = "") -> list[str]:
    """What is missing in the docstring of a public function, and what says nothing."""
    found = sections(ast.get_docstring(function) or docstring)
    entries = found.get("Parameters", {})
    named = [name for head in entries for name in head.split(" :")[0].split(", ")]
    given, result = taken(function), gives(function)
    problems = [] if named == given else [f"Parameters {named}, but it takes {given}"]
    if result and not found.get(result):
        problems.append(f"no {result}")
    said = {head.split(" :")[0] for head in found.get("Raises", {})}
    missing = raised(function) - said - ({"ProblemError"} if "InputError" in said else set())
    problems += [f"Raises lacks {name}" for name in sorted(missing)]
    return problems + [f"{h}: repeats itself" for h, words in entries.items() if repeats(h, words)]


@pytest.mark.parametrize("module", PUBLIC)
def test_a_public_function_says_what_it_takes_gives_and_raises(module: str) -> None:
    found = {name: wrong(function, inherited(name)) for name, function in functions(module)}
    assert {name: problems for name, problems in found.items() if problems} == {}


@pytest.fixture
def apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A folder of its own; afterwards no kernel of an example remains marked."""
    monkeypatch.chdir(tmp_path)
    yield
    for function in kernel.marked():
        if function.__code__.co_filename.startswith("<doctest"):
            kernel._marked.discard(function)
            if function in kernel._waiting:
                kernel._waiting.remove(function)


@pytest.mark.usefixtures("apart")
@pytest.mark.parametrize("module", PUBLIC)
def test_examples_run(module: str) -> None:
    finder = doctest.DocTestFinder(exclude_empty=True)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    failed: list[str] = []
    for named in public_names.public(public_names.full(module)):
        for each in finder.find(_thing(named.name), named.name, globs={}):
            runner.run(each, out=failed.append)
    assert "".join(failed) == ""


def exampled(thing: Any) -> bool:
    """Whether its docstring has an example."""
    return "\nExamples\n---" in (getdoc(thing) or "")


def needs_one(thing: Any) -> bool:
    """Whether it needs an example: not a protocol, nor an error without arguments of its own."""
    if isinstance(thing, type) and issubclass(thing, BaseException):
        return "__init__" in vars(thing)
    return not getattr(thing, "_is_protocol", False)


def test_a_public_function_or_class_has_an_example() -> None:
    named = [each for module in PUBLIC for each in public_names.public(public_names.full(module))]
    things = {each.home: _thing(each.name) for each in named}
    without = {home for home, each in things.items() if needs_one(each) and not exampled(each)}
    assert without == set(WITHOUT)


@pytest.mark.parametrize("why", sorted({why for why in WITHOUT.values() if "shown by" in why}))
def test_an_example_elsewhere_exists(why: str) -> None:
    name = why.split("`")[1]
    assert exampled(_thing(f"macromicro.{name}"))


def test_an_example_is_needed_by_what_takes_arguments() -> None:
    assert needs_one(macromicro.InputError) and needs_one(public_names.Named)
    assert not needs_one(macromicro.ArrivalWarning) and not needs_one(types.Clock)


def test_the_list_is_what_the_reference_shows_for_callers() -> None:
    """Users read what physics and laws compute, but do not call it."""
    shown = {name.removeprefix("macromicro.") for name in public_names.shown()}
    assert {
        name for name in shown - set(PUBLIC) if not name.startswith(("plant.", "control."))
    } == set()
    assert set(PUBLIC) <= shown


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
            The first, more.
        """
        if first < 0:
            raise ValueError(first)
        for number in (first, *more):
            yield number * scale
'''


def test_what_is_missing_is_named() -> None:
    ((name, function),) = _public(ast.parse(HALF).body[0], "here")
    assert name == "here.Thing.each"
    assert wrong(function) == [
        "Parameters ['first', '*more'], but it takes ['first', '*more', 'scale']",
        "no Yields",
        "Raises lacks ValueError",
    ]


@pytest.mark.parametrize(
    ("head", "words", "idle"),
    [
        ("dt : float", "Control period, s.", False),
        ("settings : Settings", "The settings.", True),
        ("machine : Machine", "Machine.", True),
        ("machine : Machine", "The machine to run.", False),
    ],
)
def test_words_that_repeat_a_name_are_noticed(head: str, words: str, idle: bool) -> None:
    assert repeats(head, words) is idle
