"""The command `macromicro` in a process of its own that need not import everything again.

A server that has imported what commands need is forked for each of them. Tests that send signals,
or look at how a process begins, start `python -m macromicro`.
"""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(["tests.commands_loaded"])
PATIENCE = 300.0  # s


def command(
    *words: str | Path, cwd: Path, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run it to its end: exit status and what it has printed. `env` is added to the environment."""
    line = [str(word) for word in words]
    with tempfile.TemporaryDirectory() as folder:
        streams = [Path(folder, name) for name in ("out", "err")]
        process = _CONTEXT.Process(
            target=_run, args=(line, str(cwd), {**os.environ, **(env or {})}, *map(str, streams))
        )
        process.start()
        process.join(PATIENCE)
        if process.exitcode is None:
            process.kill()
            raise TimeoutError(f"{line} in {cwd}: {streams[1].read_text(encoding='utf-8')}")
        out, err = (path.read_text(encoding="utf-8") for path in streams)
    return subprocess.CompletedProcess(line, process.exitcode, out, err)


def _run(line: list[str], cwd: str, env: dict[str, str], out: str, err: str) -> None:
    """In the process: as if Python had been started with `-m macromicro` there."""
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    for number, path, mode in ((0, os.devnull, os.O_RDONLY), (1, out, os.O_WRONLY | os.O_CREAT),
                               (2, err, os.O_WRONLY | os.O_CREAT)):  # fmt: skip
        os.dup2(os.open(path, mode, 0o600), number)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115
    sys.argv = ["macromicro", *line]
    sys.path.insert(0, cwd)
    from macromicro.__main__ import main

    status = main()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    sys.exit(status)
