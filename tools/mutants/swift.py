"""Tries most mutants without importing anything anew: only the code of functions is exchanged.

The tests are collected once; each mutant is tried in a fork of that process, in which every
function of the mutated file gets its new code, so whoever has imported it calls the new one.
Mutants outside functions, and tests that start a Python of their own, are not for this way: what
survives it is tried again by `running`.
"""

from __future__ import annotations

import ast
import contextlib
import importlib
import inspect
import json
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import types
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from beside import PACKAGE, ROOT
from beside import name as file_name
from operators import Mutant
from running import SURVIVED, TestsFail, allowed, keep_kernels, waited


def fitting(text: str, mutant: Mutant) -> bool:
    """Is the mutation inside the body of a function, and nowhere else?"""
    return any(
        node.body[0].lineno <= mutant.line <= (node.end_lineno or 0)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef) and node.lineno < mutant.line
    )


def new_machine_code(text: str, mutant: Mutant) -> bool:
    """Can a mutant of this source text change what is compiled?

    numba's cache tells functions apart by file, time and bytecode, in which neither their
    constants nor other files' are: after such a change it would hand out old machine code.
    """
    here = re.findall(r"\bcompiled\((\w+)", text)  # of this file, even without a mark
    compiles = "@kernel" in text or any(f"def {name}(" in text for name in here)
    return compiles or not fitting(text, mutant)


def _functions(module: types.ModuleType) -> Iterator[tuple[str, types.FunctionType]]:
    """Every function that a module defines, by name; methods and properties, too."""
    holders: list[Any] = [module]
    holders += [v for v in vars(module).values() if inspect.isclass(v)]
    for holder in holders:
        if holder is not module and holder.__module__ != module.__name__:
            continue
        for value in vars(holder).values():
            inner = [getattr(value, n, None) for n in ("fget", "fset", "__func__", "__wrapped__")]
            for found in (value, *inner):
                if isinstance(found, types.FunctionType) and found.__module__ == module.__name__:
                    yield found.__qualname__, found


def exchange(module: types.ModuleType, text: str) -> None:
    """Give the functions of a loaded module the code that they have in `text`."""
    other = types.ModuleType(module.__name__)
    other.__file__ = module.__file__
    vars(other)["__package__"] = module.__package__
    exec(compile(text, str(module.__file__), "exec"), vars(other))
    # Properties have several functions of one name: in the order of their definition.
    for (name, old), (same, new) in zip(_functions(module), _functions(other), strict=True):
        if name != same:
            raise RuntimeError(f"{module.__name__}: {name} is {same} in the mutant")
        old.__code__, old.__defaults__ = new.__code__, new.__defaults__
        old.__kwdefaults__ = new.__kwdefaults__


class _Plugin:
    """Takes the place of pytest's loop over the tests."""

    def __init__(self, source: Path, mutants: Sequence[Mutant], folder: Path) -> None:
        self.text, self.folder, self.mutants = source.read_text("utf-8"), folder, mutants
        parts = source.relative_to(PACKAGE.parent).with_suffix("").parts
        self.module = ".".join(parts)
        self.took: dict[str, float] = {}
        self.passed, self.seconds = False, 0.0
        self.outcomes: list[str] = []
        self.tell = 0  # where survivors are told at once, if anywhere

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            (self.folder / "killer").write_text(report.nodeid, "utf-8")
            os._exit(1)
        name = str(report.nodeid).partition("::")[0]
        self.took[name] = self.took.get(name, 0.0) + report.duration

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if session.testsfailed:
            return True  # they cannot be collected
        importlib.import_module(self.module)  # tests may import it only when they run
        began = time.monotonic()
        self.passed = self._forked(session, session.items, None, 900.0) == SURVIVED
        self.seconds = time.monotonic() - began
        if not self.passed:
            return True
        for line in (self.folder / "took").read_text("utf-8").splitlines():
            name, _, value = line.partition("\t")
            self.took[name] = float(value)
        # The quick files first; within a file the order may matter.
        items = sorted(session.items, key=lambda i: self.took[i.nodeid.partition("::")[0]])
        limit = allowed(self.seconds)
        for mutant in self.mutants:
            self.outcomes.append(self._forked(session, items, mutant, limit))
            items = self._first(items)
            if self.outcomes[-1] == SURVIVED and self.tell:
                told = f"{mutant.line}: - {mutant.before}\n     + {mutant.after}\n"
                os.write(self.tell, f"{self.module}:{told}".encode())
        return True

    def _first(self, items: list[pytest.Item]) -> list[pytest.Item]:
        """The test that failed comes first next time, if it stands alone: mistakes of the same
        lines are noticed by the same tests."""
        killer = self.folder / "killer"
        if not killer.exists():
            return items
        name = killer.read_text("utf-8")
        killer.unlink()
        found = next(i for i in items if i.nodeid == name)
        parameters = getattr(getattr(found, "callspec", None), "params", {})
        if set(getattr(found, "fixturenames", ["?"])) - set(parameters):
            return items
        return [found, *(i for i in items if i is not found)]

    def _forked(
        self,
        session: pytest.Session,
        items: list[pytest.Item],
        mutant: Mutant | None,
        limit: float,
    ) -> str:
        child = os.fork()
        if child == 0:
            try:
                self._tests(session, items, mutant)
            finally:
                os._exit(1)
        try:
            return waited(child, limit)
        finally:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(child, signal.SIGKILL)
            shutil.rmtree(self.folder / "mutated", ignore_errors=True)

    def _tests(
        self, session: pytest.Session, items: list[pytest.Item], mutant: Mutant | None
    ) -> None:
        os.setpgid(0, 0)
        changed = mutant is not None and new_machine_code(self.text, mutant)
        place = self.folder / ("mutated" if changed else "kernels")
        keep_kernels(place)
        from hypothesis import Phase, settings

        # Whether an example fails is the question, not which is the simplest.
        phases = (Phase.explicit, Phase.reuse, Phase.generate)
        settings.register_profile("mutants", settings.get_profile("macromicro"), phases=phases)
        settings.load_profile("mutants")
        if mutant is not None:
            exchange(sys.modules[self.module], mutant.text)
        for item, following in zip(items, [*items[1:], None], strict=True):
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        if mutant is None:
            lines = (f"{name}\t{value}" for name, value in self.took.items())
            (self.folder / "took").write_text("\n".join(lines), "utf-8")
        os._exit(0)


def outcomes(
    source: Path, mutants: Sequence[Mutant], tests: Sequence[Path]
) -> tuple[float, list[str]]:
    """What the tests take [s], and say of each mutant: KILLED, SURVIVED or TIMED_OUT. Raises
    TestsFail if the tests fail without a mutation."""
    folder = Path(tempfile.mkdtemp(prefix="mutants-"))
    try:
        child = os.fork()  # nothing of the package stays loaded here
        if child == 0:
            try:
                _collected(_Plugin(source, mutants, folder), tests)
            finally:
                os._exit(1)
        os.waitpid(child, 0)
        found = folder / "found.json"
        if not found.exists():
            output = (folder / "output.txt").read_text("utf-8", errors="replace")
            raise TestsFail(file_name(source), output)
        seconds, said = json.loads(found.read_text("utf-8"))
        return seconds, said
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _collected(plugin: _Plugin, tests: Sequence[Path]) -> None:
    """The forked process: collects the tests, tries the mutants, writes what was found."""
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT))
    sys.dont_write_bytecode = True
    plugin.tell = os.dup(2) if os.environ.get("MUTANTS_TELL") else 0
    quiet = os.open(plugin.folder / "output.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    options = ["-x", "-q", "-s", "-p", "no:cacheprovider", "-p", "no:randomly", "-m", "not slow"]
    pytest.main([*options, *map(str, tests)], plugins=[plugin])
    if plugin.passed:
        told = json.dumps([plugin.seconds, plugin.outcomes])
        (plugin.folder / "found.json").write_text(told, "utf-8")
    os._exit(0)
