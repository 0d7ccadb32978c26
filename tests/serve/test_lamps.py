"""Lines of two axes in one number of the status."""

from __future__ import annotations

import math
from pathlib import Path

from macromicro.rig.session import Session
from macromicro.serve import _lamps
from macromicro.serve.joint import _opening, settings
from macromicro.serve.joint._rig import Led
from macromicro.serve.shared import LINES, packed

PLOTTER = Path(__file__).parents[2] / "examples" / "machines" / "xy-plotter.toml"
SWITCHES = """
[x.switches]
limits = "low"
[y.switches]
home = "cam"
"""
DRIVE = "[y.amplifier]\n", '[y.amplifier]\nenable = "line"\n'


def test_what_is_packed_is_told() -> None:
    x = {"limit_low": 1.0, "home": 0.0}
    y = {"limit_high": math.nan, "enable": 1.0, "enabled": 0.0}
    assert _lamps.told(_lamps.packed([x, y])) == (
        ("x_limit_low", True),
        ("x_home", False),
        ("y_limit_high", True),
        ("y_enabled", False),
        ("y_enable", True),
    )
    assert _lamps.told(0.0) == () and _lamps.packed([{}, {}]) == 0.0


def test_all_of_them_fit_into_the_memory_of_a_float() -> None:
    full = dict.fromkeys(_lamps.NAMES, 1.0)
    assert set(full) == set(LINES) - {"index_count"}
    number = _lamps.packed([full, full])
    form = packed(1)
    assert form.unpack(form.pack(number)) == (number,)
    assert len(_lamps.told(number)) == 2 * len(full)
    assert all(on for _, on in _lamps.told(number))


def test_two_axes_tell_the_lines_that_their_settings_name(tmp_path: Path) -> None:
    file = tmp_path / "xy.toml"
    file.write_text(
        PLOTTER.read_text(encoding="utf-8").replace(*DRIVE) + SWITCHES, encoding="utf-8"
    )
    found = settings.load(file)
    assert found is not None
    rig = _opening.simulated(found, 0)
    rig.read()
    led = Led(Session(rig, found.period), rig)
    names = [name for name, _ in _lamps.told(led.lamps())]
    assert names == ["x_limit_low", "y_home", "y_enabled", "y_enable"]
    said = dict(_lamps.told(led.lamps()))
    assert not said["x_limit_low"] and not said["y_enable"]
    rig.lines[0] = rig.lines[0]._replace(limit_low=1.0)
    assert dict(_lamps.told(led.lamps()))["x_limit_low"]
