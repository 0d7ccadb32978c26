"""Both axes on two rigs of the user's: asked for, brought to their start, driven in step."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro import cli
from macromicro.errors import InputError
from macromicro.machines import on_rig
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.recording import Recording
from macromicro.runs import job
from macromicro.runs.setup import Blocks
from macromicro.types import SAFE
from tests.command import BARE

MINE = """
from pathlib import Path
from macromicro.machines import compositions, rig
from macromicro.types import SAFE

CONFIG = Path(__file__).with_name("m.toml")

def made(k, seed):
    _, machine, own = compositions.each(CONFIG)[k]
    return rig.CompiledTwin(machine.kind, own, seed)

def x(seed):
    return made(0, seed)

def y(seed):
    "It stands some way from its zero."
    there = made(1, seed)
    for _ in range(100):
        there.write(SAFE._replace(motor=2.0))
        there.advance()
    there.stop()
    for _ in range(400):
        there.advance()
    return there

def held(seed):
    "The same with its motor's lead off."
    there = y(seed)
    there._advanced, old = lambda effort: old(0.0), there._advanced
    return there

def quick(seed):
    there = x(seed)
    there.dt = 0.5e-3
    return there
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a machine's file and a module of rigs."""
    (tmp_path / "m.toml").write_text('machine = "xy"\n[x.travel]\nhigh = "60 mm"\n')
    (tmp_path / "two_mine.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    sys.modules.pop("two_mine", None)
    return tmp_path


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    def call(rig: str, *words: str) -> int:
        line = [*BARE, "--config", "m.toml", "--rig", rig, "--out", "out", *words]
        monkeypatch.setattr("sys.argv", ["macromicro", *line])
        return cli.main()

    return call


def test_it_says_what_will_move_and_asks(
    lab: Path, called: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert called("two_mine:x+two_mine:y") == 2
    said = capsys.readouterr().err
    assert "x on two_mine:x" in said and "y on two_mine:y" in said and "Add --yes" in said
    assert "first to 0 mm by its encoder" in said and not (lab / "out").exists()


def test_both_are_driven_in_step_from_where_they_stand(
    lab: Path, called: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert called("two_mine:x+two_mine:y", "--yes") == 0
    assert "nan" not in capsys.readouterr().out
    mine = Recording.load(lab / "out" / "recording.h5")
    assert mine.attributes["rig"] == "two_mine:x+two_mine:y"
    twin = job.execute(job.check(job.Request(config=lab / "m.toml", out=lab / "twin"))).recording
    # It begins within the tolerance of 0, not at it: but for that the moves are the twin's.
    assert len(mine) == pytest.approx(len(twin), rel=0.02)
    n = min(len(mine), len(twin))
    for name in ("x_position", "y_position"):
        assert np.max(np.abs(mine[name][:n] - twin[name][:n])) < 1.0, name  # mm
        assert np.max(np.abs(mine[name] - mine[name.replace("position", "target")])) < 0.3
    assert np.max(mine["y_position"]) > 50.0


def test_an_axis_that_does_not_come_to_its_start_ends_it(
    lab: Path, called: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert called("two_mine:x+two_mine:held", "--yes") == 1
    assert "the way to 0 mm, where the programme begins" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name", ["two_mine:x", "twin+two_mine:y", "two_mine:x+two_mine:y+two_mine:y"]
)
def test_other_than_two_rigs_are_refused(lab: Path, name: str) -> None:
    with pytest.raises(InputError) as error:
        on_rig.find_rigs(name, XY_MACHINE, DEFAULT, 0)
    assert error.value.where == "--rig" and "mylab:x+mylab:y" in error.value.accepted


def test_a_file_with_a_plus_in_its_name_is_one_rig(lab: Path) -> None:
    assert on_rig.several("a+b.toml") and not on_rig.several("mylab:x")
    (lab / "a+b.toml").write_text("")
    assert not on_rig.several("a+b.toml")


def test_a_rig_of_another_period_is_refused_with_it(lab: Path) -> None:
    with pytest.raises(InputError) as error:
        on_rig.find_rigs("two_mine:x+two_mine:quick", XY_MACHINE, DEFAULT, 0)
    assert "timing.period" in error.value.where and "0.0005 s" in error.value.accepted


def test_the_twin_needs_none() -> None:
    made: Any = on_rig.find_rigs("twin", XY_MACHINE, DEFAULT, 0)
    assert made is None


def test_each_is_recorded_by_itself(lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ["collect", "drive", "--config", "m.toml", "--out", "c", "--rig"]
    monkeypatch.setattr("sys.argv", ["macromicro", *words, "two_mine:x"])
    assert cli.main() == 2 and not (lab / "c").exists()
    monkeypatch.setattr("sys.argv", ["macromicro", *words, "two_mine:x+two_mine:y"])
    assert cli.main() == 0
    for name, high in (("x", 0.06), ("y", DEFAULT.y.travel.high)):
        seen = Recording.load(lab / "c" / name / "drive.h5")["x"]
        assert 0.3 * high < np.max(seen) - np.min(seen) < 1.05 * high, name


LINES = """
machine = "xy"
[x.amplifier]
enable = "line"
enable_time = "20 ms"
[y.amplifier]
enable = "line"
enable_time = "150 ms"
"""


@pytest.mark.slow
def test_drives_with_an_enable_line_are_on_before_the_programme(
    lab: Path, called: Callable[..., int]
) -> None:
    (lab / "m.toml").write_text(LINES)
    assert called("two_mine:x+two_mine:y", "--yes") == 0
    mine = Recording.load(lab / "out" / "recording.h5")
    assert mine["t"][0] == 0.0
    for name in ("x", "y"):
        assert np.all(mine[f"{name}_enable"] == 1.0) and np.all(mine[f"{name}_enabled"] == 1.0)


def test_interrupted_both_are_safe_and_nothing_is_lost(lab: Path) -> None:
    checked = job.check(job.Request(None, lab / "o", lab / "m.toml", rig="two_mine:x+two_mine:y"))
    assert checked.source is not None
    pair = on_rig.open_rigs(checked.source, 0)
    sink, seen = Blocks(), []

    def enough(t: float, move: int) -> None:
        seen.append(t)
        if t > 0.5:
            assert any(session._rig._outputs != SAFE for session in pair.rigs)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        what = (checked.setup.machine, checked.settings, checked.setup.plan, sink, pair)
        on_rig.perform(*what, progress=enough)
    assert sum(block.shape[1] for block in sink.blocks) == round(seen[-1] / 1e-3) > 500
    assert all(session._rig._outputs == SAFE for session in pair.rigs)
