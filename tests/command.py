"""The command `macromicro` in a process of its own that need not import everything again.

Tests that send signals, or look at how a process begins, start `python -m macromicro`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from tests import warm

PATIENCE = 300.0  # s
BARE = ("run", "--figures", "none")  # where what is drawn is not what is tested


def command(
    *words: str | Path, cwd: Path, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run it to its end: exit status and what it has printed. `env` is added to the environment."""
    line = [sys.executable, "-m", "macromicro", *map(str, words)]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = warm.Command(
            line, cwd=cwd, env={**os.environ, **(env or {})},
            stdin=subprocess.DEVNULL, stdout=out, stderr=err,
        )  # fmt: skip
        try:
            status = process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read())
    return subprocess.CompletedProcess(line[3:], status, *texts)
