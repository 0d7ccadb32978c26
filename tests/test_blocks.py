"""The commands of README and docs/identify.md run as printed, in order, in a clean folder.

A command that cannot run in a test is listed here with the reason; any other that fails, or a
listed one that is no longer printed, fails the test.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# Page -> beginnings of commands, with the reason.
CANNOT = {
    "README.md": {
        "macromicro identify drive motor.csv": "the reader's own data",
        "macromicro identify linear steps.h5": "the reader's own data",
        "macromicro identify hysteresis curves.txt": "the reader's own data",
        "macromicro sweep examples/sweep-gains.toml": "tested with the sweeps",
        "macromicro robust": "200 machines: tested with fewer by tests/robustness",
    },
    "docs/identify.md": {
        "macromicro identify drive own.csv": "the reader's own data",
        "macromicro identify drive DATA_EMPS.mat": "not part of the repository",
        "macromicro identify hysteresis curves.csv": "the reader's own data",
    },
}


def commands(page: str) -> list[str]:
    """The commands of a page's indented blocks, without comments."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.findall(r"^    (macromicro .*)$", text, re.MULTILINE)
    return [line.partition("  #")[0].strip() for line in found]


def cannot(page: str, command: str) -> bool:
    return any(command.startswith(start) for start in CANNOT[page])


@pytest.mark.parametrize("page", CANNOT)
def test_what_is_left_out_is_printed(page: str) -> None:
    for start in CANNOT[page]:
        assert any(command.startswith(start) for command in commands(page)), start


@pytest.mark.slow
@pytest.mark.parametrize("page", CANNOT)
def test_commands_run_as_printed(page: str, tmp_path: Path) -> None:
    """Files that a page shows as TOML are there under the names it uses for them."""
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    for name, block in zip(("wave.toml", "sticky.toml"), blocks, strict=False):
        (tmp_path / name).write_text(block, encoding="utf-8")
    shutil.copy(ROOT / "tests" / "data" / "forc" / "hchb_forc", tmp_path)
    for command in commands(page):
        if cannot(page, command):
            continue
        words: list[str] = []
        for word in shlex.split(command)[1:]:
            paths = sorted(str(p.relative_to(tmp_path)) for p in tmp_path.glob(word))
            words += paths if "*" in word else [word]
        done = subprocess.run(
            [sys.executable, "-m", "macromicro", *words],
            cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}: {done.stderr}"
