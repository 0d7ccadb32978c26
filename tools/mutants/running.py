"""Runs the tests beside a file on one mutant after the other, each in a forked process.

Heavy libraries are imported once, before the fork. The package itself is imported after it,
from a copy in which one file is mutated.
"""

from __future__ import annotations

import compileall
import contextlib
import os
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from beside import PACKAGE, ROOT

KILLED, SURVIVED, TIMED_OUT = "killed", "survived", "timed out"
_SLACK = 20.0  # s beyond ten times what the tests take without a mutation


class TestsFail(Exception):
    """The tests beside a file fail without a mutation, so that they can tell nothing."""

    def __init__(self, name: str, output: str) -> None:
        super().__init__(f"{output[-3000:]}\n{name}: its tests fail without a mutation")


class Bench:
    """A copy of the package in a folder of its own, one file of it mutated at a time."""

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="mutants-"))
        self._package = self._folder / "src" / "macromicro"
        shutil.copytree(PACKAGE, self._package, ignore=shutil.ignore_patterns("__pycache__"))
        compileall.compile_dir(self._package, quiet=2)
        self._kernels = self._folder / "kernels"
        self._kernels.mkdir()

    def close(self) -> None:
        """Delete the copy."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def run(
        self,
        source: Path,
        text: str | None,
        tests: list[Path],
        limit: float,
        fresh: bool = False,
    ) -> str:
        """KILLED, SURVIVED or TIMED_OUT: what the tests say of `source` with this text.

        `fresh`: the text makes other machine code, so that none is taken from a cache.
        """
        place = self._package / source.relative_to(PACKAGE)
        original = source.read_text("utf-8")
        # Two texts of one size within a second look the same to Python.
        for stale in place.parent.glob(f"__pycache__/{place.stem}.*"):
            stale.unlink()
        place.write_text(original if text is None else text, "utf-8")
        child = os.fork()
        if child == 0:
            self._child(tests, fresh)
        try:
            return waited(child, limit)
        finally:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(child, signal.SIGKILL)
            place.write_text(original, "utf-8")
            shutil.rmtree(self._folder / "cache", ignore_errors=True)

    def _child(self, tests: list[Path], fresh: bool) -> None:
        """The forked process: runs the tests and ends with 0 if all passed."""
        status = 1
        try:
            os.setpgid(0, 0)
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

            if not fresh:
                keep_kernels(self._kernels)
            options = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", "-m", "not slow"]
            status = int(pytest.main([*options, *map(str, tests)]))
        finally:
            os._exit(0 if status == 0 else 1)

    def output(self) -> str:
        """What the last run of the tests printed."""
        return (self._folder / "output.txt").read_text("utf-8", errors="replace")


def keep_kernels(folder: Path) -> None:
    """Have this process keep its compiled kernels in a folder, whatever its sources are."""
    from macromicro import kernel

    kernel.cache_folder = lambda joined=True: folder


class Baseline(NamedTuple):
    """The tests without a mutation: do they pass, and how long do they take [s]?"""

    passed: bool
    seconds: float


def baseline(bench: Bench, source: Path, tests: list[Path]) -> Baseline:
    """Run the tests on the file as it is."""
    began = time.monotonic()
    verdict = bench.run(source, None, tests, 900.0)
    return Baseline(verdict == SURVIVED, time.monotonic() - began)


def allowed(seconds: float) -> float:
    """Time [s] after which a mutant counts as noticed: it never ends."""
    return 10.0 * seconds + _SLACK


def waited(child: int, limit: float) -> str:
    """What became of a forked process: KILLED if it failed, TIMED_OUT after `limit` [s]."""
    until = time.monotonic() + limit
    while time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return SURVIVED if os.waitstatus_to_exitcode(status) == 0 else KILLED
        time.sleep(0.005)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return TIMED_OUT
