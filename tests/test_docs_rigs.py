"""docs/rigs.md: its rig runs as it stands there, and its tables name what there is."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from macromicro.machines import open_rig
from macromicro.recording import Recording
from macromicro.rig.session import BENCH, KINDS
from macromicro.types import Lines
from tests.command import command as macromicro
from tests.systems import posix
from tests.warm import Command

PAGE = (Path(__file__).parents[1] / "docs" / "rigs.md").read_text(encoding="utf-8")
RIG, USE, LINED = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def test_the_page_s_rig_with_lines_is_a_stage_with_these_lines() -> None:
    room: dict[str, Any] = {}
    exec(LINED, room)
    made = room["Axis"]()
    made.now, made.counts, made.inputs = lambda: 0.5, lambda: 7.0, (1.0, 0.0)
    made.clock = SimpleNamespace(now=made.now, wait=lambda dt: None)
    assert open_rig.of(made).lines == ("limit_low", "limit_high", "enable")
    params = open_rig.open_stage(made, 1e-3)
    kind = open_rig.of(made)
    assert kind.measure(params, 0.0, 0.0, None, 0).position == pytest.approx(7e-3)
    said = kind.sense(params, 0.0)
    assert (said.limit_low, said.limit_high, said.drive_fault) == (0.0, 1.0, 0.0)
    kind.switch(params, 0.0, 1.0)
    kind.advance(params, 0.0, 2.5, None, 0, 1e-3)
    assert (made.volts, made.on) == (2.5, True)


def test_the_page_names_the_lines() -> None:
    for name in Lines._fields:
        assert f"`{name}`" in PAGE and name in KINDS[BENCH].channels


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """A folder with the page's module."""
    (tmp_path / "mylab.py").write_text(RIG, encoding="utf-8")
    return tmp_path


def run(lab: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """A command of the package, or Python."""
    if words[:2] == ("-m", "macromicro"):
        return macromicro(*words[2:], cwd=lab)
    return subprocess.run(
        [sys.executable, *words], cwd=lab, stdin=subprocess.DEVNULL, capture_output=True,
        text=True, check=False,
    )  # fmt: skip


def test_the_page_s_rig_runs(lab: Path) -> None:
    """At 2 V beyond its friction for 0.2 s it goes 400 counts; the last sample is 1 ms short."""
    done = run(lab, "-c", USE)
    assert done.returncode == 0, done.stderr
    channels, first, last = re.fullmatch(r"(\(.*\)) (\S+) (\S+)", done.stdout.strip()).groups()
    assert channels == "('encoder',)"
    assert abs(float(first) - 400.0) <= 1.0
    assert float(last) - float(first) == pytest.approx(398.0, abs=1.0)


MOVES = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[0]


def test_the_programme_runs_on_it(lab: Path) -> None:
    """Asked for first; nothing moves and nothing is written unless somebody agrees."""
    (lab / "moves.toml").write_text(MOVES, encoding="utf-8")
    words = ("-m", "macromicro", "run", "moves.toml", "--rig", "mylab:bench")
    refused = run(lab, *words)
    assert refused.returncode == 2 and not (lab / "results").exists()
    assert "2 set points from 10 to 20 mm, motor up to 5 V" in refused.stderr
    assert "confirmation needed" in refused.stderr and "--yes" in refused.stderr
    done = run(lab, *words, "--yes", "--json")
    assert done.returncode == 0, done.stderr
    found = Recording.load(lab / "results" / "moves" / "recording.h5")
    assert found.attributes["rig"] == "mylab:bench" and "laser" not in found
    moves = json.loads(done.stdout)["moves"]
    assert [move["final_error"] for move in moves] == [pytest.approx(0.0, abs=0.15)] * 2
    fine = run(lab, "-m", "macromicro", "run", "thesis", "--rig", "mylab:bench", "--yes")
    assert fine.returncode == 2 and "needs hall" in fine.stderr


def test_the_command_collects_on_it(lab: Path) -> None:
    done = run(lab, "-m", "macromicro", "collect", "--rig", "mylab:bench", "drive", "--out", "o")
    assert done.returncode == 0, done.stderr
    assert "on mylab:bench" in done.stderr
    found = Recording.load(lab / "o" / "drive.h5")
    assert found.attributes["bench"] == "mylab:bench"
    refused = run(lab, "-m", "macromicro", "collect", "--rig", "mylab:bench", "hall")
    assert refused.returncode == 2
    assert "needs hall, laser of the bench, mylab:bench measures encoder" in refused.stderr


SLOW = """
import pathlib, sys, time
import mylab

class Slow(mylab.Carriage):
    def wait(self, dt):
        time.sleep(dt)
        super().wait(dt)
    def write(self, outputs):
        super().write(outputs)
        if outputs.motor:
            print("driving", file=sys.stderr, flush=True)
    def __exit__(self, *what):
        super().__exit__(*what)
        pathlib.Path("left").write_text(f"{self.outputs.motor}")

def bench(seed):
    return Slow()
"""


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_leaves_the_rig_safe(lab: Path, number: int) -> None:
    """Sent while the motor is on."""
    (lab / "slow.py").write_text(SLOW, encoding="utf-8")
    words = ["-m", "macromicro", "collect", "--rig", "slow:bench", "drive", "--out", "o"]
    process = Command([sys.executable, *words], cwd=lab, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    while "driving" not in process.stderr.readline():
        assert process.poll() is None
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + number and "Traceback" not in errors
    assert (lab / "left").read_text() == "0.0"
    assert not (lab / "o").exists()


def test_every_channel_and_kind_stands_there() -> None:
    for kind, known in KINDS.items():
        row = re.search(rf'^\| `"{kind}"` \|(.*)$', PAGE, re.MULTILINE)
        assert row is not None
        for channel in known.channels:
            assert f"`{channel}`" in row.group(1), channel
