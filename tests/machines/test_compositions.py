"""All machines, of whatever family, by one table: the thesis' is one of them."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from macromicro.errors import InputError
from macromicro.machines import compositions, machine
from macromicro.schema.par import entries
from tests.machines import own

own.module()
EVERY = pytest.mark.parametrize("one", compositions.MACHINES, ids=lambda one: one.name)
SRC = Path(compositions.__file__).parents[1]


def test_every_machine_is_there_once() -> None:
    names = [one.name for one in compositions.MACHINES]
    assert names == list(machine.NAMES) and len(set(names)) == len(names)
    assert all(one.title and entries(one.settings) for one in compositions.MACHINES)


@EVERY
def test_its_settings_are_printed_and_read_back(one: Any, tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(machine.as_toml(one, one.settings), encoding="utf-8")
    assert compositions.of_file(path).name == one.name
    assert compositions.settings_of(path) == one.settings
    first = next(e.path for e in entries(one.settings) if "." in e.path).partition(".")[0]
    assert machine.as_toml(one, one.settings, first).startswith(f"[{first}")


@EVERY
def test_a_law_of_another_package_takes_its_place(one: Any, tmp_path: Path) -> None:
    law = "tests.control.own_laws:sliding"
    path = tmp_path / "m.toml"
    path.write_text(machine.as_toml(one, one.settings), encoding="utf-8")
    if one.name == "xy":
        by_default, of_file = compositions.by_default, compositions.settings_of
        for asked in (lambda: by_default(one, law), lambda: of_file(path, law)):
            with pytest.raises(InputError, match="each axis has a law of its own"):
                asked()
        return
    for made in (compositions.by_default(one, law), compositions.settings_of(path, law)):
        assert any(entry.value == law for entry in entries(made))
        assert made != one.settings


def test_no_file_and_a_file_that_names_none_are_the_two_stage_machine_s(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text("[guard]\npush = '3 V'\n", encoding="utf-8")
    assert compositions.of_file(path).name == compositions.of_file(None).name == "two_stage"
    path.write_text("machine = 'axel'\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"m\.toml, machine: 'axel'; accepted: .*axis"):
        compositions.of_file(path)


def test_a_machine_of_another_package_is_one_too() -> None:
    made = compositions.by_name("ownlab:flexure", "test")
    assert (made.name, made.written) == ("ownlab:flexure", '"ownlab:flexure"')


def test_nobody_else_asks_which_machine_it_is_by_its_name() -> None:
    """The name of the thesis' machine stands where it is made, exported and commissioned."""
    found = subprocess.run(
        ["grep", "-rlE", "[\"']two_stage[\"']", "--include=*.py", str(SRC)],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert {str(Path(name).relative_to(SRC)) for name in found} == {
        "settings.py",
        "serve/settings.py",
        "machines/machine.py",
        "export/_units.py",
        "commands/_commissioning.py",
    }
