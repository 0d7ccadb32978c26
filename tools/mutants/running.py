"""Runs the tests beside a file on one mutant after the other, each in a forked process.

Heavy libraries are imported once, before the fork. The package itself is imported after it,
from a copy in which one file is mutated.
"""

from __future__ import annotations

import ast
import atexit
import compileall
import contextlib
import os
import re
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from beside import PACKAGE, ROOT
from operators import Mutant

KILLED, SURVIVED, TIMED_OUT = "killed", "survived", "timed out"
_LONGEST = 900.0  # s that the tests may take without a mutation
_SLACK = 10.0  # s beyond three times that
_OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", "-m", "not slow")


class TestsFail(Exception):
    """The tests beside a file fail without a mutation, so that they can tell nothing."""


class Bench:
    """A copy of the package in a folder of its own, one file of it mutated at a time."""

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="mutants-"))
        atexit.register(shutil.rmtree, self._folder, ignore_errors=True)
        self._package = self._folder / "src" / "macromicro"
        shutil.copytree(PACKAGE, self._package, ignore=shutil.ignore_patterns("__pycache__"))
        compileall.compile_dir(self._package, quiet=2)
        self._killer = ""  # the test that noticed the last mutant

    def baseline(self, source: Path, tests: list[Path]) -> float:
        """How long the tests take on the file as it is [s]; raises TestsFail."""
        began = time.monotonic()
        if self._run(source, source.read_text("utf-8"), tests, _LONGEST, "kernels") != SURVIVED:
            raise TestsFail(self._output()[-3000:])
        return time.monotonic() - began

    def tried(self, source: Path, mutant: Mutant, tests: list[Path], seconds: float) -> str:
        """KILLED, SURVIVED or TIMED_OUT: what tests say that take so long without a mutation."""
        changed = new_machine_code(source.read_text("utf-8"), mutant)
        try:
            cache, limit = "mutated" if changed else "kernels", 3.0 * seconds + _SLACK
            # Mistakes of the same lines are noticed by the same tests.
            outcome = SURVIVED
            if self._killer:
                outcome = self._run(source, mutant.text, [self._killer], limit, cache)
            if outcome == SURVIVED:
                outcome = self._run(source, mutant.text, tests, limit, cache)
                self._killer = failed_test(self._output())
            return outcome
        finally:
            shutil.rmtree(self._folder / "mutated", ignore_errors=True)

    def _output(self) -> str:
        """What the last run of the tests printed."""
        return (self._folder / "output.txt").read_text("utf-8", "replace")

    def _run(
        self, source: Path, text: str, tests: Sequence[Path | str], limit: float, cache: str
    ) -> str:
        place = self._package / source.relative_to(PACKAGE)
        # Two texts of one size within a second look the same to Python.
        for stale in place.parent.glob(f"__pycache__/{place.stem}.*"):
            stale.unlink()
        place.write_text(text, "utf-8")
        try:
            return forked(lambda: self._tested(tests, self._folder / cache), limit)
        finally:
            place.write_text(source.read_text("utf-8"), "utf-8")
            shutil.rmtree(self._folder / "cache", ignore_errors=True)

    def _tested(self, tests: Sequence[Path | str], kernels: Path) -> bool:
        """In the forked process: do the tests pass?"""
        quiet = os.open(self._folder / "output.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        os.chdir(ROOT)
        where = str(self._folder / "src")
        os.environ |= {
            "PYTHONPATH": where,
            "PYTHONDONTWRITEBYTECODE": "1",
            "MACROMICRO_CACHE": str(self._folder / "cache"),
        }
        sys.dont_write_bytecode = True
        sys.path[:0] = [where, str(ROOT)]
        import pytest

        keep_kernels(kernels)
        return pytest.main([*_OPTIONS, *map(str, tests)]) == pytest.ExitCode.OK


def failed_test(output: str) -> str:
    """The test function that failed first, "" if none did.

    Without the parameters in its name, which may hold spaces: pytest does not find a test by half
    a name, and that would look like a test that failed.
    """
    failed = re.search(r"^FAILED ([^\s\[]+)", output, re.MULTILINE)
    return failed[1] if failed else ""


def new_machine_code(text: str, mutant: Mutant) -> bool:
    """Can a mutant of this source text change what is compiled?

    numba's cache tells functions apart by file, time and bytecode, in which neither their
    constants nor other files' are: after such a change it would hand out old machine code.
    """
    here = re.findall(r"\bcompiled\((\w+)", text)  # of this file, even without a mark
    within_a_function = any(
        node.body[0].lineno <= mutant.line <= (node.end_lineno or 0)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef) and node.lineno < mutant.line
    )
    compiles = "@kernel" in text or any(f"def {name}(" in text for name in here)
    return compiles or not within_a_function


def keep_kernels(folder: Path) -> None:
    """Have this process keep its compiled kernels in a folder, whatever its sources are."""
    from macromicro import kernel

    folder.mkdir(exist_ok=True)
    kernel.cache_folder = lambda joined=True: folder


def forked(passes: Callable[[], bool], limit: float) -> str:
    """What becomes of a function in a process of its own: KILLED if it is false or raises,
    TIMED_OUT after `limit` [s]. What it has started ends with it."""
    child = os.fork()
    if child == 0:
        passed = False
        try:
            os.setpgid(0, 0)
            passed = passes()
        finally:
            os._exit(0 if passed else 1)
    until = time.monotonic() + limit
    outcome = TIMED_OUT
    while outcome == TIMED_OUT and time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            outcome = SURVIVED if os.waitstatus_to_exitcode(status) == 0 else KILLED
        time.sleep(0.005)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)
    if outcome == TIMED_OUT:
        os.waitpid(child, 0)
    return outcome
