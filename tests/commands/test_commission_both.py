"""`macromicro commission --kind two_stage`, as a person calls it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from macromicro import cli
from macromicro.settings import Settings
from tests.command import BARE
from tests.command import command as macromicro


def command(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return macromicro(*words, cwd=folder)


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (("--kiln", "mylab:kiln"), "--kiln: .*only with --kind two_stage"),
        (("--kind", "two_stage", "--kiln", "mylab:kiln"), "--kiln: .*only with --rig"),
        (
            ("--kind", "two_stage", "--pitch", "5 um"),
            "--pitch: .*not allowed with --kind two_stage",
        ),
        (("--kind", "two_stage", "--to", "5 mm"), "--to: .*not allowed with --kind two_stage"),
        (("--kind", "two_stage", "--rig", "x:y", "--config", "a.toml"), "--config: .*--rig"),
        (("--kind", "two_stage", "--config", "a.toml"), "a.toml"),
    ],
)
def test_what_does_not_go_together_is_said(
    tmp_path: Path,
    words: tuple[str, ...],
    match: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["macromicro", "commission", *words, "--out", "out"])
    assert cli.main() == 2
    said = capsys.readouterr().err
    assert re.search(match, said), said
    assert not (tmp_path / "out").exists()


def test_results_that_are_there_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "commission.html").write_text("mine")
    words = ["macromicro", "commission", "--kind", "two_stage", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    assert cli.main() == 2 and "already exists" in capsys.readouterr().err
    assert (tmp_path / "commission.html").read_text() == "mine"


@pytest.mark.slow
def test_both_stages_from_their_sensors_to_a_machine_that_runs(tmp_path: Path) -> None:
    """On a bench whose belt is not that which the laws' defaults know."""
    (tmp_path / "bench.toml").write_text('[bench.belt]\nfrequency = "20.5 Hz"\n')
    words = ("commission", "--kind", "two_stage", "--config", "bench.toml", "--out", "out")
    done = command(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    assert "verification: 10 of 10 moves arrived" in done.stdout
    found = json.loads((tmp_path / "out" / "commission.json").read_text())
    assert found["verification"]["met"]
    values = {line["name"]: line for line in found["parts"]["carriage"]["values"]}
    belt = values["frequency"]
    # The bench's step of the midpoint rule takes 0.016 % of it.
    assert belt["value"] == pytest.approx(20.5, rel=3e-4)
    assert abs(belt["value"] - Settings().bench.belt.frequency) > 1.0
    page = (tmp_path / "out" / "commission.html").read_text()
    assert "all 10 moves arrived" in page and "carriage, frequency" in page
    assert "latent heat over the wires" in page and page.count("<img") > 4
    run = command(tmp_path, *BARE, "fast", "--config", "out/machine.toml", "--out", "run")
    assert run.returncode == 0, run.stderr
    # What is complete is not done again; the verification is.
    again = command(tmp_path, *words, "--resume")
    assert again.returncode == 0, again.stderr
    assert [line for line in again.stderr.splitlines() if line.endswith(": done")] == [
        "verification: done"
    ]
