"""`macromicro commission` as a person calls it, on a rig of one's own, in processes."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.command import command as macromicro
from tests.systems import posix

from macromicro.commands._commissioning import show_rows

ROOT = Path(__file__).parents[2]
RIG = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from tests.commission.axes import PLAIN, Virtual

def bench(seed):
    return Virtual(PLAIN, late=1, pitch=1e-4)
"""


def command(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return macromicro("commission", *words, cwd=folder)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mylab.py").write_text(RIG)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (("--pitch", "5 um"), "--pitch"),
        (("--kind", "wire"), "--kind: only with --rig"),
        (("--port", "/dev/ttyUSB0"), "--port: needs --rig board"),
        (("--rig", "board", "--pitch", "5 um"), "--port: the board's serial port is missing"),
        (("--rig", "mylab:bench"), "travel per encoder count"),
        (("--rig", "mylab:bench", "--pitch", "5 V"), "--pitch"),
        (("--rig", "mylab:bench", "--pitch", "100 um"), "--effort"),
        (("--rig", "mylab:bench", "--config", "x.toml"), "--config"),
        (("--calibrate",), "the carriage of the two-stage machine is not calibrated"),
        (("--calibrate", "--kind", "two_stage"), "--calibrate: not allowed"),
        (
            ("--rig", "mylab:bench", "--pitch", "1 um", "--effort", "8 V", "--calibrate"),
            "--calibrate needs laser",
        ),
        (("--creep", "9 m/s"), "--creep"),
        (("--from", "-5 mm"), "both, or none"),
        (("--ends", "none"), "--ends: only with --rig"),
        (("--ends", "some", "--rig", "mylab:bench", "--pitch", "1 um"), "accepted: stops or none"),
        (("--ends", "none", "--rig", "mylab:bench", "--pitch", "1 um"), "only with a rotary kind"),
        (("--rig", "mylab:bench", "--pitch", "100 um", "--effort", "8 V"), "confirmation needed"),
    ],
)
def test_what_is_missing_or_wrong_is_said(folder: Path, words: tuple[str, ...], match: str) -> None:
    done = command(folder, *words, "--out", "out")
    assert done.returncode == 2
    assert match in done.stderr
    assert not (folder / "out").exists()


@posix
@pytest.mark.slow
def test_an_interrupted_commissioning_is_resumed(folder: Path) -> None:
    words = ("--rig", "mylab:bench", "--pitch", "100 um", "--effort", "8 V", "--speed", "1 m/s",
             "--yes", "--out", "out")  # fmt: skip
    line = [sys.executable, "-m", "macromicro", "commission", *words]
    with subprocess.Popen(line, cwd=folder, stderr=subprocess.PIPE, text=True) as run:
        kept = folder / "out" / "steps-direction.json"
        until = time.monotonic() + 60.0
        while not kept.exists() and time.monotonic() < until:
            time.sleep(0.01)
        run.send_signal(signal.SIGINT)
        said = run.communicate()[1]
    assert run.returncode == 130, said
    assert "to continue: --resume" in said
    before = kept.read_text()
    again = command(folder, *words)
    assert again.returncode == 2
    done = command(folder, *words, "--resume")
    assert done.returncode == 0, done.stderr
    assert "sign and breakaway" not in done.stderr
    assert "7 of 7 moves arrived" in done.stdout
    assert kept.read_text() == before
    assert json.loads((folder / "out" / "commission.json").read_text())["verification"]["met"]


def test_what_was_found_is_printed_with_units_behind_the_figures(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Also where a remark stands for the interval, and under a name that is longer than others."""
    remark = "9.18e-05 s by the search, whose gains are rejected"
    show_rows([("settling on the stage", "0.04", remark, "s"), ("mass", "2.9", "+- 0.1", "kg")])
    one, two = (line.split() for line in capsys.readouterr().out.splitlines())
    assert one == ["settling", "on", "the", "stage", "0.04", "s", *remark.split()]
    assert two == ["mass", "2.9", "kg", "+-", "0.1"]
