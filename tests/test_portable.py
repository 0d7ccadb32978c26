"""The package without what only Linux and macOS have: `tests/deprived` takes it away."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.request import urlopen

import pytest

from tests.systems import posix

pytestmark = posix  # elsewhere these names are missing anyway

ROOT = Path(__file__).parents[1]
PATIENCE = 300.0  # s
ENV = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "tests/deprived"), *sys.path])}
IMPORT_ALL = """
import importlib, pkgutil, macromicro
for found in pkgutil.walk_packages(macromicro.__path__, "macromicro."):
    if not found.name.endswith("__main__"):
        importlib.import_module(found.name)
print("imported")
"""
TAKEN = """
import sys
for text in ("import fcntl", "import os; os.fork", "import socket; socket.AF_UNIX",
             "import signal; signal.SIGHUP", "from pathlib import Path; Path('/proc/stat').open()"):
    try:
        exec(text, {"__name__": "macromicro.example"})
    except (ImportError, AttributeError, FileNotFoundError):
        exec(text, {"__name__": "example"})
    else:
        sys.exit(f"not taken away: {text}")
"""
SHORT = """title = "short"
[[moves]]
macro = ["5 mm"]
hold = "0.1 s"
"""


def python(
    *words: str | Path, cwd: Path, status: int = 0, more: Mapping[str, str] | None = None
) -> str:
    done = subprocess.run(
        [sys.executable, *map(str, words)], cwd=cwd, env={**ENV, **(more or {})},
        capture_output=True, encoding="utf-8", timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout


def macromicro(*words: str | Path, cwd: Path) -> str:
    return python("-m", "macromicro", *words, cwd=cwd)


@pytest.mark.slow
def test_the_suite_is_collected_without_these_names() -> None:
    """What needs them at run time has a mark of `tests.systems`."""
    words = ("-m", "pytest", "-q", "--collect-only", "-p", "no:cacheprovider", "tests")
    python(*words, cwd=ROOT, more={"DEPRIVED": "macromicro,tests"})


def test_the_names_are_taken_from_this_package_alone(tmp_path: Path) -> None:
    python("-c", TAKEN, cwd=tmp_path)


@pytest.mark.slow
def test_every_module_is_imported_without_them(tmp_path: Path) -> None:
    assert python("-c", IMPORT_ALL, cwd=tmp_path) == "imported\n"


@pytest.mark.slow
def test_a_run_and_an_identification(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT, encoding="utf-8")
    macromicro("run", "short.toml", cwd=tmp_path)
    assert (tmp_path / "results/short/report.html").is_file()
    macromicro("run", "short.toml", "--overwrite", "--out", "results/short", cwd=tmp_path)
    found = python(ROOT / "examples/own_csv.py", "own", cwd=tmp_path)
    assert re.search(r"^mass +1\.2", found, re.MULTILINE)


@pytest.mark.slow
def test_a_sweep_of_two_processes(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="the extra `sweep` brings it")
    text = 'job = "macro-bench"\n[parameters]\nreference = ["500 counts", "1000 counts"]\n'
    (tmp_path / "steps.toml").write_text(text, encoding="utf-8")
    macromicro("sweep", "steps.toml", "--workers", "2", cwd=tmp_path)
    assert (tmp_path / "results/steps/results.parquet").is_file()


def served(words: Sequence[str], folder: Path) -> tuple[str, str]:
    """The page and what a server has printed, which Ctrl-C ends."""
    output = folder / "serve.txt"
    with output.open("w", encoding="utf-8") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "macromicro", "serve", *words], cwd=folder, env=ENV,
            stdout=file, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    try:
        deadline = time.monotonic() + PATIENCE
        found = None
        while found is None:
            assert process.poll() is None and time.monotonic() < deadline, output.read_text("utf-8")
            time.sleep(0.1)
            found = re.search(r"http://127\.0\.0\.1:\d+/", output.read_text("utf-8"))
        with urlopen(found[0], timeout=PATIENCE) as answer:
            page = answer.read().decode()
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 130, output.read_text("utf-8")
    finally:
        process.kill()
        process.wait()
    return page, output.read_text("utf-8")


@pytest.mark.slow
def test_a_server_answers_with_soft_timing(tmp_path: Path) -> None:
    words = ("--web", "0", "--scpi", "0", "--state", str(tmp_path / "state.json"))
    page, printed = served(words, tmp_path)
    assert "<!DOCTYPE html>" in page[:200]
    assert "soft timing: this system grants no real-time priority" in printed
    assert not re.search("Traceback|fault|Error", printed)
