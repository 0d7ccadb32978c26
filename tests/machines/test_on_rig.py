"""`macromicro run --config machine.toml --rig`: a machine of one stage on a rig of the user's."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from macromicro import cli
from macromicro.errors import InputError, MacromicroError
from macromicro.machines import machine, on_rig, performing, runs
from macromicro.machines.on_rig import Rigs
from macromicro.machines.planning import Schedule
from macromicro.recording import Recording
from macromicro.runs import job
from macromicro.runs.setup import Blocks
from tests.command import BARE
from tests.systems import posix

MINE = """
import math
from pathlib import Path
from macromicro.machines import machine, rig
from macromicro.types import SAFE

CONFIG = Path(__file__).with_name("m.toml")

def axis(seed):
    made, tree = machine.load(CONFIG)
    return rig.CompiledTwin(made.kind, tree, seed)

def away(seed):
    "It stands some way from its zero."
    there = axis(seed)
    for _ in range(200):
        there.write(SAFE._replace(motor=3.0))
        there.advance()
    there.stop()
    for _ in range(400):
        there.advance()
    return there

def held(seed):
    "The same with its motor's lead off."
    there = away(seed)
    there._advanced, old = lambda effort: old(0.0), there._advanced
    return there

def blind(seed):
    there = axis(seed)
    there.channels = ("hall",)
    return there

def oven(seed):
    there = axis(seed)
    there.kind, there.channels = "kiln", ("encoder",)
    return there
"""
PROGRAMME = '[[moves]]\nmacro = ["12 mm", "2 mm"]\nhold = "0.05 s"\n'


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a machine's file, a programme and a module of rigs."""
    import sys

    (tmp_path / "m.toml").write_text('machine = "axis"\n[load]\npayload = "0.2 kg"\n')
    (tmp_path / "p.toml").write_text(PROGRAMME)
    (tmp_path / "on_mine.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    sys.modules.pop("on_mine", None)
    return tmp_path


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    def call(rig: str, *words: str) -> int:
        line = [*BARE, "p.toml", "--config", "m.toml", "--rig", rig, "--out", "out", *words]
        monkeypatch.setattr("sys.argv", ["macromicro", *line])
        return cli.main()

    return call


def test_nobody_was_asked(
    lab: Path, called: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert called("on_mine:axis") == 2
    said = capsys.readouterr().err
    assert "first to 0 mm by its encoder, at up to 0." in said and "Add --yes" in said
    assert "2 set points from 1.99" in said and "to 12.0" in said and "up to 10 V" in said
    assert not (lab / "out").exists()


def test_it_runs_as_the_simulated_machine_does(
    lab: Path, called: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    """The rig is that very machine: what it does from its zero is the same, counts apart."""
    assert called("on_mine:axis", "--yes", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert [m["arrived_s"] is not None for m in told["moves"]] == [True, True]
    found = Recording.load(lab / "out" / "recording.h5")
    assert found.attributes["rig"] == "on_mine:axis" and "true_position" not in found
    made, tree = machine.load(lab / "m.toml")
    alone = runs.record(
        made, tree, job.check(job.Request("p.toml", config=lab / "m.toml")).programme
    )
    assert found["position"][-1] == pytest.approx(alone.recording["position"][-1], abs=0.03)
    assert (lab / "out" / "report.html").exists()


def test_from_elsewhere_it_goes_to_its_start_first(
    lab: Path, called: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert called("on_mine:away", "--yes", "--json") == 0
    assert all(m["arrived_s"] is not None for m in json.loads(capsys.readouterr().out)["moves"])
    found = Recording.load(lab / "out" / "recording.h5")
    tolerance = 1e3 * machine.load(lab / "m.toml")[1].arrival.tolerance
    assert abs(found["position"][0]) <= tolerance and found["t"][0] == 0.0
    import on_mine

    assert on_mine.away(0).read().encoder > 100.0  # so there was a way


def test_what_does_not_come_there_ends_before_the_programme(
    lab: Path, called: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert called("on_mine:held", "--yes") == 1
    said = capsys.readouterr().err
    assert "the way to 0 mm, where the programme begins: " in said


@posix
@pytest.mark.parametrize(
    ("rig", "said"),
    [
        ("on_mine:blind", "needs encoder of the bench"),
        ("on_mine:oven", "Use a bench for a programme."),
        ("replay:x.h5", "only the two-stage machine can replay a recording"),
        (
            "board:/dev/null,loop=board",
            "--loop board: the law of this machine runs on the host. Use --loop host",
        ),
    ],
)
def test_what_cannot_be_is_told_before_anything_moves(
    lab: Path,
    called: Callable[..., int],
    capsys: pytest.CaptureFixture[str],
    rig: str,
    said: str,
) -> None:
    assert called(rig, "--yes") == 2
    assert said in capsys.readouterr().err and not (lab / "out").exists()


def test_another_period_is_refused(lab: Path) -> None:
    tree = machine.load(lab / "m.toml")[1]
    quick: Any = tree._replace(timing=tree.timing._replace(period=0.25e-3))
    with pytest.raises(InputError, match=r"timing\.period: '0\.00025 s'; accepted: 0\.001 s"):
        on_rig.find_rigs("on_mine:axis", machine.MACHINES[0], quick, 0)
    assert on_rig.find_rigs("twin", machine.MACHINES[0], quick, 0) is None


def test_a_way_of_which_nothing_is_left_is_no_arrival(lab: Path) -> None:
    """Where the law ends its patience beside the target, the programme does not begin."""
    made, tree = machine.load(lab / "m.toml")
    weak = tree._replace(
        controller=tree.controller._replace(position=0.01, velocity=0.01, integral=0.0, loosen=0.0,
                                            ahead_friction=0.0, ahead_velocity=0.0,
                                            ahead_acceleration=0.0),
        guard=tree.guard._replace(error=1.0),
    )  # fmt: skip
    checked = job.check(job.Request("p.toml", config=lab / "m.toml"))
    rigs = on_rig.find_rigs("on_mine:away", made, weak, 0)
    assert rigs is not None
    blocks = Blocks()
    with pytest.raises(MacromicroError, match="the stage stopped at"):
        on_rig.perform(made, weak, checked.setup.plan, blocks, on_rig.open_rigs(rigs, 0))
    assert blocks.blocks == []


def test_a_rig_of_its_own_period_is_collected_from(
    lab: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (lab / "m.toml").write_text('machine = "axis"\n[timing]\nperiod = "0.5 ms"\n')
    slow = "\ndef slow(seed):\n    there = axis(seed)\n    there.dt = 1e-3\n    return there\n"
    (lab / "on_mine.py").write_text(MINE + slow)
    words = ["collect", "drive", "--config", "m.toml", "--out", "c", "--rig"]
    monkeypatch.setattr("sys.argv", ["macromicro", *words, "on_mine:slow"])
    assert cli.main() == 2 and "timing.period" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["macromicro", *words, "on_mine:axis"])
    assert cli.main() == 0
    assert Recording.load(lab / "c" / "drive.h5").dt == pytest.approx(0.5e-3)


class Fake:
    """A rig that says when it is entered, left alone and left."""

    channels, clock = (), None

    def __init__(self, name: str, said: list[str], fails: bool = False) -> None:
        self.name, self.said, self.fails = name, said, fails

    def __enter__(self) -> None:
        if self.fails:
            raise OSError("no such port")
        self.said.append(f"{self.name} entered")

    def __exit__(self, *_: object) -> None:
        self.said.append(f"{self.name} left")

    def idle(self, seconds: float) -> None:
        self.said.append(f"{self.name} idle {seconds:g}")


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    there: list[str] = []

    def bring(machine: Any, settings: Any, plan: Any, rig: Any) -> None:
        there.append(f"{rig._rig.name} brought")

    monkeypatch.setattr(on_rig, "bring", bring)
    return there


def performed(rigs: list[Fake], sink: Any) -> Any:
    """A programme of two stages on these rigs."""
    nothing: Any = None
    stages = SimpleNamespace(
        stages=(("x", nothing), ("y", nothing)), trees=lambda settings: (nothing, nothing)
    )
    made: Any = stages
    plans = Schedule((nothing, nothing), ())
    return on_rig.perform(made, nothing, plans, sink, Rigs(rigs, [1.0, 2.0]))


def test_all_are_entered_before_one_moves_and_left_however_it_ends(
    said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    sink = Blocks()

    def run(machine: Any, settings: Any, planned: Any, blocks: Blocks, **how: Any) -> None:
        assert [rig._rig.name for rig in how["on"]] == ["x", "y"]
        said.append("run")
        blocks.append(np.ones((2, 3)))
        blocks.append(np.zeros((2, 1)))
        raise KeyboardInterrupt

    monkeypatch.setattr(performing, "perform", run)
    with pytest.raises(KeyboardInterrupt):
        performed([Fake("x", said), Fake("y", said)], sink)
    entered = ["x entered", "y entered", "x idle 1", "y idle 2", "x brought", "y brought"]
    assert said == [*entered, "run", "y left", "x left"]
    assert [block.tolist() for block in sink.blocks] == [[[1.0, 1.0, 1.0, 0.0]] * 2]


def test_where_one_cannot_be_entered_nothing_moves(said: list[str]) -> None:
    with pytest.raises(OSError, match="no such port"):
        performed([Fake("x", said), Fake("y", said, fails=True)], Blocks())
    assert said == ["x entered", "x left"]
