"""Figures of a hobby motor's sheet in a settings file: what follows, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from macromicro.errors import InputError, ProblemError
from macromicro.machines import compositions
from macromicro.plant.winding import winding

SHEET = """
[motor]
voltage = "12 V"
stall_current = "5.5 A"
no_load_speed = "10000 rpm"
no_load_current = "0.2 A"
"""


def settings(folder: Path, text: str, name: str = "axis") -> Any:
    (folder / "m.toml").write_text(f'machine = "{name}"\n{text}', encoding="utf-8")
    return compositions.load(folder / "m.toml")[1]


def test_at_no_load_the_back_emf_and_the_drop_are_the_supply() -> None:
    speed = 10_000 * 2.0 * math.pi / 60.0
    found = winding(
        {"voltage": 12.0, "stall_current": 5.5, "no_load_speed": speed, "no_load_current": 0.2}, ""
    )
    assert found["resistance"] * 5.5 == pytest.approx(12.0)
    assert found["constant"] * speed + found["resistance"] * 0.2 == pytest.approx(12.0)


@pytest.mark.parametrize("name", ["axis", "rotary"])
def test_a_file_may_give_them(tmp_path: Path, name: str) -> None:
    motor = settings(tmp_path, SHEET, name).motor
    assert motor.resistance == pytest.approx(2.1818, rel=1e-4)
    assert motor.constant == pytest.approx(0.011042, rel=1e-4)


def test_inches_gear_and_counts_a_turn(tmp_path: Path) -> None:
    """A screw of 0.2 inch behind a gear of 4, 48 counts a turn of the motor."""
    text = '[drive]\nkind = "screw"\nlead = "0.2 inch"\ngear = 4\n[encoder]\ncounts = 48\n'
    encoder = settings(tmp_path, SHEET + text).encoder
    assert encoder.lines == 12.0
    assert encoder.pitch == pytest.approx(0.2 * 0.0254 / 4 / 48)


def test_an_axis_of_a_table_may_have_them(tmp_path: Path) -> None:
    tree = settings(tmp_path, SHEET.replace("[motor]", "[x.motor]"), "xy")
    assert tree.x.motor.resistance == pytest.approx(2.1818, rel=1e-4)
    assert tree.y.motor.resistance == 1.2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[motor]\nstall_current = "5 A"\n', "stall_current without voltage and no_load_speed"),
        (SHEET + 'resistance = "2 ohm"\n', "motor.resistance: set, and it also follows from"),
        (SHEET.replace("0.2 A", "6 A"), "no_load_current is not below stall_current"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        settings(tmp_path, text)


def test_bounds_and_units_are_checked(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"motor\.stall_current"):
        settings(tmp_path, '[motor]\nstall_current = "5 V"\n')
