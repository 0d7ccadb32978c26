"""Two axes on one clock commissioned as one machine."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.command import BARE
from tests.command import command as macromicro
from tests.systems import posix
from typer.testing import CliRunner

from macromicro.cli import app
from macromicro.commission import plane, report, running
from macromicro.commission.procedure import Options
from macromicro.commission.stand import CommissionError
from macromicro.errors import InputError
from macromicro.machines import compositions, sheets
from macromicro.report import plane as pages
from macromicro.rig.limits import LIVE
from macromicro.schema.text import parsed_toml
from macromicro.types import SAFE

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
RIGS = """
from pathlib import Path

from macromicro.machines import compositions, rig

HERE = Path(__file__).parent
LOG = HERE / "log"


class Mine(rig.CompiledTwin):
    def __init__(self, k, seed):
        _, machine, own = compositions.each(HERE / "xy.toml")[k]
        super().__init__(machine.kind, own, seed)
        self.name, self.driven = "xy"[k], False

    def tell(self, what):
        with LOG.open("a") as log:
            print(self.name, what, file=log)

    def __enter__(self):
        self.tell("entered")
        return self

    def write(self, outputs):
        super().write(outputs)
        if outputs.motor and not self.driven:
            self.driven = True
            self.tell("driven")

    def stop(self):
        super().stop()
        self.tell("stopped")

    def __exit__(self, *error):
        self.tell("left")


def x(seed):
    return Mine(0, seed)

def y(seed):
    return Mine(1, seed)

def weak(seed):
    "Its own limits allow less than the file does."
    from macromicro.rig.limits import LIVE
    made = y(seed)
    made.limits = LIVE._replace(motor=3.0)
    return made
"""

LEFT = ["y stopped", "y left", "x stopped", "x left"]


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The rigs of both axes, as a module in a folder with their file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "xy.toml").write_text(TABLE)
    name = f"plane{os.getpid()}"
    (tmp_path / f"{name}.py").write_text(RIGS)
    monkeypatch.delitem(sys.modules, name, raising=False)
    return name


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
        places, pair.members, compositions.each(tmp_path / "xy.toml"), strict=True
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
    assert "square" in done.output
    told = json.loads((out / report.JSON).read_text())
    assert told["verification"]["met"] and set(told["axes"]) == {"x", "y"}
    truth = compositions.load(tmp_path / "xy.toml")[1]
    for name, own in (("x", truth.x), ("y", truth.y)):
        mass = told["axes"][name]["model"]["mass"]
        true = sheets.per_newton(own) * sheets.mass(own)
        assert abs(mass["value"] - true) < max(2.0 * mass["half_width_95"], 0.02 * true)
        assert (out / name / report.PAGE).is_file()
    page = (out / report.PAGE).read_text()
    assert page.count("data:image/png;base64,") == len(pages.DRAWN)
    _, settings = compositions.load(out / report.MACHINE)
    assert settings.stack.carries == "nothing" and settings.x.load.payload == 0.0
    run = [*BARE, "--config", str(out / report.MACHINE), "--out", str(tmp_path / "run")]
    assert CliRunner().invoke(app, run).exit_code == 0
    # Nothing is replaced, and what was kept is not done again.
    assert isinstance(CliRunner().invoke(app, words).exception, InputError)
    again = CliRunner().invoke(app, [*words, "--resume"])
    assert again.exit_code == 0 and "x, chirp for modes: done" not in again.output


def test_two_rigs_are_places_of_a_files_pitches_and_drives(lab: str) -> None:
    pair, places = plane.own_places(Path("xy.toml"), f"{lab}:x+{lab}:weak", 0)
    tree = compositions.load(Path("xy.toml"))[1]
    assert [place.name for place in places] == [f"axis x on {lab}:x", f"axis y on {lab}:weak"]
    assert [place.effort for place in places] == [tree.x.controller.limit, 3.0] and LIVE.motor > 3.0
    assert all(place.real and place.pitch == tree.x.encoder.pitch for place in places)
    assert [place.make(0) for place in places] == list(pair.members)


def test_both_are_open_and_the_other_has_no_effort(
    lab: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair, places = plane.own_places(Path("xy.toml"), f"{lab}:x+{lab}:y", 0)
    x, y = (session._rig for session in pair.rigs)

    def commission(place: running.Place, *args: Any, **options: Any) -> Any:
        with place.make(0) as half:
            half.write(SAFE._replace(motor=2.0))
            for _ in range(50):
                half.wait(place.dt)
            assert x._outputs.motor == 2.0 and y._outputs == SAFE and x.tick == y.tick == 50
            raise CommissionError("it does not move")

    monkeypatch.setattr(running, "commission", commission)
    allowed = Options(5.0, 0.5, 0.02, 0.5)
    with pytest.raises(CommissionError):
        plane.commission(pair, places, (allowed, allowed))
    log = Path("log").read_text().splitlines()
    assert log[:2] == ["x entered", "y entered"] and log[-4:] == LEFT and "y driven" not in log
    assert x._outputs == y._outputs == SAFE


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--config", "xy.toml"), "Add --yes"),
        ((), "--config: 'missing'; accepted: a file of the machine xy"),
        (("--config", "one.toml"), "--config: 'one.toml'; accepted: a file of the machine xy"),
        (("--config", "xy.toml", "--pitch", "5 um"), "--pitch: not allowed with two axes"),
        (
            ("--config", "xy.toml", "--ends", "none"),
            "--ends: both axes of this machine are straight",
        ),
    ],
)
def test_what_two_rigs_need_is_said_before_they_move(
    lab: str, words: tuple[str, ...], said: str
) -> None:
    Path("one.toml").write_text('machine = "axis"\n')
    rig = ("--rig", f"{lab}:x+{lab}:y")
    done = macromicro("commission", *rig, *words, "--out", "out", cwd=Path.cwd())
    assert done.returncode == 2 and said in done.stderr
    assert not Path("log").exists() or "driven" not in Path("log").read_text()


@posix
@pytest.mark.slow  # half a minute: two axes from their first motion on
def test_two_rigs_are_interrupted_and_commissioned_in_the_end(lab: str) -> None:
    line = [sys.executable, "-m", "macromicro", "commission", "--config", "xy.toml"]
    line += ["--rig", f"{lab}:x+{lab}:y", "--out", "out", "--yes"]
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        kept = []
        for told in process.stderr:
            kept += [told.strip()] if told.endswith(": done\n") else []
            if len(kept) == 2:
                process.send_signal(signal.SIGINT)
                break
        rest = process.stderr.read()
        assert process.wait(60) == 130 and "to continue: --resume" in rest
    log = Path("log").read_text().splitlines()
    assert "x driven" in log and "y driven" not in log and log[-4:] == LEFT
    done = CliRunner().invoke(app, [*line[3:], "--resume"])
    assert done.exit_code == 0, done.output
    assert not [each for each in kept if each in done.output] and len(kept) == 2
    assert "verification of both: 10 of 10 moves arrived" in done.output
    told = json.loads(Path("out", report.JSON).read_text())
    truth = compositions.load(Path("xy.toml"))[1]
    for name, own in (("x", truth.x), ("y", truth.y)):
        mass = told["axes"][name]["model"]["mass"]
        true = sheets.per_newton(own) * sheets.mass(own)
        assert abs(mass["value"] - true) < max(2.0 * mass["half_width_95"], 0.02 * true)
    assert f"axis x on {lab}:x and axis y on {lab}:y" in Path("out", report.PAGE).read_text()
    settings = compositions.load(Path("out", report.MACHINE))[1]
    assert settings.stack.carries == "nothing"
    log = Path("log").read_text().splitlines()
    assert log[-4:] == LEFT and log.count("x entered") == 2 and "y driven" in log
