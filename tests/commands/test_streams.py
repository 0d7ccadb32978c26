"""A closed pipe is no failure of the command that wrote to it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest


def unread(*words: str) -> subprocess.Popen[bytes]:
    """The command, its output already closed by the reader."""
    read, write = os.pipe()
    os.close(read)
    try:
        return subprocess.Popen(
            [sys.executable, "-m", "macromicro", *words], stdout=write, stderr=subprocess.PIPE
        )
    finally:
        os.close(write)


@pytest.mark.parametrize("words", [["config", "show"], ["collect", "--list"], ["--help"]])
def test_what_nobody_reads_is_dropped(words: list[str]) -> None:
    with unread(*words) as process:
        _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, b"")


def test_a_run_writes_its_results_all_the_same(tmp_path: Path) -> None:
    with unread("run", "staircase", "--out", str(tmp_path / "out")) as process:
        _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (tmp_path / "out" / "report.html").exists()
