"""Lines of a stage in one number of the status."""

from __future__ import annotations

import math
from pathlib import Path

from macromicro.rig.session import Session
from macromicro.serve import _lamps
from macromicro.serve.shared import LINES
from macromicro.serve.stage import opening, settings
from macromicro.serve.stage.rig import Guarded

PLOTTER = Path(__file__).parents[2] / "examples" / "machines" / "xy-plotter.toml"
SWITCHES = """
[x.switches]
limits = "low"
[y.switches]
home = "cam"
"""
DRIVE = "[y.amplifier]\n", '[y.amplifier]\nenable = "line"\n'


def test_what_is_packed_is_told() -> None:
    lines = {"limit_low": 1.0, "limit_high": math.nan, "home": 0.0, "enabled": 0.0, "enable": 1.0}
    assert _lamps.told(_lamps.packed(lines), "y") == (
        ("y_limit_low", True),
        ("y_limit_high", True),
        ("y_home", False),
        ("y_enabled", False),
        ("y_enable", True),
    )
    assert _lamps.told(0.0) == () and _lamps.packed({}) == 0.0
    full = dict.fromkeys(LINES, 1.0)
    assert _lamps.told(_lamps.packed(full)) == tuple((n, True) for n in LINES if n != "index_count")


def test_each_stage_tells_the_lines_that_its_settings_name(tmp_path: Path) -> None:
    file = tmp_path / "xy.toml"
    file.write_text(
        PLOTTER.read_text(encoding="utf-8").replace(*DRIVE) + SWITCHES, encoding="utf-8"
    )
    found = settings.load(file)
    rig = opening.simulated(found, 0)
    rig.read()
    led = Guarded(Session(rig, found.period), rig, found.axes)
    x, y = (dict(_lamps.told(number)) for number in led.lamps())
    assert x == {"limit_low": False} and list(y) == ["home", "enabled", "enable"]
    assert not y["enable"]
    rig.lines[0] = rig.lines[0]._replace(limit_low=1.0)
    assert dict(_lamps.told(led.lamps()[0]))["limit_low"]
