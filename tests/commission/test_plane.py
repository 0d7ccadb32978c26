"""Two axes on one clock commissioned as one machine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from macromicro.cli import app
from macromicro.commission import plane, report
from macromicro.errors import InputError
from macromicro.machines import compositions, sheets
from macromicro.machines.joint import machine as joint
from macromicro.report import plane as pages
from macromicro.schema.text import parsed_toml

TABLE = """machine = "xy"
[stack]
body = "0.3 kg"
[x.encoder]
lines = 4000
[x.load]
stop_high = "150 mm"
[y.encoder]
lines = 4000
[y.load]
mass = "1 kg"
stop_high = "120 mm"
"""


class Found:
    """As much of a commissioned axis as its file takes."""

    def __init__(self, toml: str) -> None:
        self.toml = toml


def test_the_file_has_both_and_neither_carries_the_other() -> None:
    one = "# Found.\n# Mass.\n\n"
    one += 'machine = "axis"\n\n[load]\nmass = "{} kg"\n\n[travel]\nlow = "0 mm"\n'
    axes: Any = tuple(Found(one.format(m)) for m in (2.0, 0.5))
    text = plane.as_toml(axes)
    assert parsed_toml(text, "text") == {
        "machine": "xy",
        "stack": {"carries": "nothing"},
        "x": {"load": {"mass": "2.0 kg"}, "travel": {"low": "0 mm"}},
        "y": {"load": {"mass": "0.5 kg"}, "travel": {"low": "0 mm"}},
    }
    assert text.startswith("# Axis x.\n# Found.\n# Mass.\n#\n# Axis y.\n")


def test_each_axis_is_a_place_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "xy.toml").write_text(TABLE)
    pair, places = plane.virtual(tmp_path / "xy.toml", 3)
    for place, half, (name, _, own) in zip(
        places, pair.halves, compositions.each(tmp_path / "xy.toml"), strict=True
    ):
        assert place.name.startswith(f"axis {name} of") and place.make(3) is half
        assert place.pitch == own.encoder.pitch and place.effort == own.controller.limit


@pytest.mark.slow  # half a minute: two axes from their first motion on
def test_a_machine_of_two_axes_is_commissioned(tmp_path: Path) -> None:
    """What is found runs: its masses have what each carries, and moves of both verify it."""
    (tmp_path / "xy.toml").write_text(TABLE)
    out = tmp_path / "out"
    words = ["commission", "--config", str(tmp_path / "xy.toml"), "--out", str(out)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "verification of both: 10 of 10 moves arrived" in done.output
    assert "right angle" in done.output
    told = json.loads((out / report.JSON).read_text())
    assert told["verification"]["met"] and set(told["axes"]) == {"x", "y"}
    truth = joint.load(tmp_path / "xy.toml")[1]
    for name, own in (("x", truth.x), ("y", truth.y)):
        mass = told["axes"][name]["model"]["mass"]
        true = sheets.per_newton(own) * sheets.mass(own)
        assert abs(mass["value"] - true) < max(2.0 * mass["half_width_95"], 0.02 * true)
        assert (out / name / report.PAGE).is_file()
    page = (out / report.PAGE).read_text()
    assert page.count("data:image/png;base64,") == len(pages.DRAWN)
    _, settings = joint.load(out / report.MACHINE)
    assert settings.stack.carries == "nothing" and settings.x.load.payload == 0.0
    run = ["run", "--config", str(out / report.MACHINE), "--out", str(tmp_path / "run")]
    assert CliRunner().invoke(app, run).exit_code == 0
    # Nothing is replaced, and what was kept is not done again.
    assert isinstance(CliRunner().invoke(app, words).exception, InputError)
    again = CliRunner().invoke(app, [*words, "--resume"])
    assert again.exit_code == 0 and "x, chirp for modes: done" not in again.output
