"""The README's first screen does what it says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import macromicro

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def python_blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


@pytest.mark.slow
def test_example_runs_as_printed(tmp_path: Path) -> None:
    """Eleven lines that print every move of the integrated test and draw it."""
    code = python_blocks(README)[0]
    assert len(code.splitlines()) == 11
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines[:5]] == ["macro"] + ["micro"] * 4
    assert len(lines) == 41 and "None" not in done.stdout
    assert lines[-1] == "40 moves arrived at 11 N" and not done.stderr
    for name in ("run.png", "both.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("seed", [0, 1])
def test_a_short_hold_ends_where_the_readme_says(seed: int) -> None:
    """Some 7 um off by the laser; all later holds of `staircase`, two seconds each, within 5."""
    held = macromicro.moves(macromicro.run("staircase", seed=seed))
    first, *others = [abs(m.final_error or 0.0) for m in held if m.stage == "micro"]
    assert 6.5 <= first <= 7.5
    assert max(others) <= 5.0


def test_first_screen_names_make_targets() -> None:
    """`make run` and `make test` stand before the first heading of the second level, the way to
    the command and to the tutorials, too."""
    screen = README.partition("\n## ")[0]
    named = re.findall(r"^    make ([a-z-]+)", screen, re.MULTILINE)
    assert named == ["run", "serve"] and "`make test`" in screen
    assert ". .venv/bin/activate" in screen and "(docs/index.md)" in screen
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in {*named, *re.findall(r"`make ([a-z-]+)`", README)}:
        assert re.search(rf"^{target}:.* ##", makefile, re.MULTILINE), target


def test_three_doors_of_three_commands_can_be_repeated() -> None:
    """Each replaces its results; tests/test_blocks.py runs them."""
    screen = README.partition("\n## ")[0]
    doors = re.findall(r"^\*\*I .*\n\n((?:    macromicro .*\n)+)", screen, re.MULTILINE)
    assert [len(door.splitlines()) for door in doors] == [3, 3, 3]
    assert all(line.endswith("--overwrite") for door in doors for line in door.splitlines())


def test_it_is_three_screens_long() -> None:
    assert len(README) <= 7000 and len(README.splitlines()) <= 90
    rows = re.findall(r"^\| (?!you want|---)", README, re.MULTILINE)
    assert 0 < len(rows) <= 15


def test_configuration_examples_are_accepted(tmp_path: Path) -> None:
    """docs/running.md shows a settings file as the package reads it."""
    from macromicro.schema import config
    from macromicro.settings import Settings

    page = (ROOT / "docs/running.md").read_text(encoding="utf-8")
    settings = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)[0]
    (tmp_path / "sticky.toml").write_text(settings, encoding="utf-8")
    changed = config.load_overrides(tmp_path / "sticky.toml", Settings())
    assert changed.bench.friction.coulomb == 11.0
    assert changed.controller.macro_law == "pd-initial"


def test_figure_is_small_enough_for_a_first_screen() -> None:
    """1200 x 800 px, below 200 kB."""
    data = (ROOT / "docs/figures/integrated-run.png").read_bytes()
    size = [int.from_bytes(data[k : k + 4], "big") for k in (16, 20)]
    assert size == [1200, 800] and len(data) < 200_000
