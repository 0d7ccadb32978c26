"""`macromicro examples` from a checkout; tests/test_dist.py has it from the wheel."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command import command

ROOT = Path(__file__).parents[2]


def test_the_files_are_copied_into_a_new_folder(tmp_path: Path) -> None:
    done = command("examples", "mine", cwd=tmp_path)
    assert done.returncode == 0
    then = Path("mine/machines/stage.toml")
    assert done.stdout == f"examples: mine\nthen: macromicro run --config {then}\n"
    assert (tmp_path / then).is_file()
    for place, folder in (("", ROOT / "examples"), ("tutorials", ROOT / "docs/tutorials")):
        for file in folder.rglob("*"):
            if file.is_file() and "__pycache__" not in file.parts:
                copy = tmp_path / "mine" / place / file.relative_to(folder)
                assert copy.read_bytes() == file.read_bytes()


@pytest.mark.parametrize("name", ["taken", "file"])
def test_an_existing_folder_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    (tmp_path / "file").write_text("mine")
    done = command("examples", name, cwd=tmp_path)
    assert done.returncode == 2
    assert f"{name}: the folder already exists. Name a new one: macro" in done.stderr
    assert not list((tmp_path / "taken").iterdir())
