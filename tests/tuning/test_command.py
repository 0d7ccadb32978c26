"""``macromicro tune`` as a user meets it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.command import BARE
from tests.command import command as macromicro
from tests.systems import posix
from tests.warm import Command

COMMAND = [sys.executable, "-m", "macromicro"]


def command(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return macromicro(*arguments, cwd=cwd)


@pytest.mark.slow
def test_tune_then_run(tmp_path: Path) -> None:
    """The settings that it leaves are settings that a run takes."""
    done = command("tune", "macro", "--evaluations", "48", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "are better: objective" in done.stdout and "try: macromicro run" in done.stdout
    tuned = tmp_path / "results" / "tune-macro" / "tuned.toml"
    (tmp_path / "one.toml").write_text('[[moves]]\nmacro = "150 mm"\nhold = "0.5 s"\n')
    ran = command(*BARE, "one.toml", "--config", str(tuned), "--json", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert "pd_tuned.now" in ran.stdout
    again = command("tune", "macro", "--out", "results/tune-macro", cwd=tmp_path)
    assert again.returncode == 2
    assert "already exists" in again.stderr


def test_json_alone(tmp_path: Path) -> None:
    words = ("tune", "macro", "--evaluations", "5", "--json", "--out", "o")
    done = command(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["law"] == "pd-tuned"
    assert done.stdout == (tmp_path / "o" / "tuning.json").read_text()


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["nano"], "stage"),
        (["macro", "--law", "lqr"], "--law"),
        (["macro", "--objective", "beauty"], "--objective"),
        (["macro", "--evaluations", "0"], "--evaluations"),
        (["macro", "--config", "none.toml"], "none.toml"),
        ([], "Give macro or micro"),
        (["macro", "--penalty", "overshoot=much"], "--penalty"),
        (["macro", "--benches", "16"], "--benches"),
    ],
)
def test_bad_input(arguments: list[str], named: str, tmp_path: Path) -> None:
    done = command("tune", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert named in done.stderr
    assert not list(tmp_path.iterdir())


def test_no_number(tmp_path: Path) -> None:
    done = command("tune", "macro", "--evaluations", "many", cwd=tmp_path)
    assert done.returncode == 2
    assert "'many'; accepted: a whole number" in done.stderr


@posix
def test_an_interrupt_keeps_the_best_so_far(tmp_path: Path) -> None:
    """Ctrl-C in a search that would take minutes."""
    process = Command(
        [*COMMAND, "tune", "macro", "--evaluations", "1000000"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    assert process.stderr is not None
    assert "tuning macro, settling" in process.stderr.readline()
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "the best so far" in said and "interrupted after" in said
    assert (tmp_path / "results" / "tune-macro" / "tuned.toml").exists()
