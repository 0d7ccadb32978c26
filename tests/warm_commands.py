"""What the commands import, for the process that is forked for each of them."""

from __future__ import annotations

import contextlib
import importlib
import io
import pkgutil
import sys
import tempfile
from pathlib import Path

import macromicro

THREADED = ("ophyd", "ophyd_async")  # clients that start threads, of which a fork has none
sys.modules |= dict.fromkeys(THREADED)  # their import fails
for module in pkgutil.walk_packages(macromicro.__path__, "macromicro.", onerror=lambda name: None):
    if not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ImportError:  # of an extra that is not installed
            continue
for name in THREADED:
    del sys.modules[name]


def _warmed() -> None:
    """Kernels of two machines and what draws figures are in memory before anything is forked."""
    from macromicro.cli import command_line

    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
    ):
        programme = Path(folder, "short.toml")
        programme.write_text('[[moves]]\nmacro = ["1 mm"]\nmicro = ["0.1 mm"]\nhold = "0.1 s"\n')
        axis = Path(folder, "axis.toml")
        axis.write_text('machine = "axis"\n')
        for words in (("run", str(programme)), ("run", "--config", str(axis))):
            line = [*words, "--out", str(Path(folder, "out")), "--overwrite"]
            command_line()(line, standalone_mode=False)


with importlib.import_module("tests.warm_loops").compiling():
    _warmed()
