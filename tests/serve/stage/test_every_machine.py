"""Every machine that ships, under every command that takes a settings file: none is forgotten."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest
from tests.command import command as macromicro
from tests.serve.stage.test_served import served

from macromicro.commission import collecting
from macromicro.machines import compositions
from macromicro.machines import machine as machines
from macromicro.thesis.collecting import PROCEDURES

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"
# Of each the settings with which it is quick, and what a tuning is asked for.
FILES = {
    "two_stage": ("", "macro"),
    "axis": ("stage", "axis"),
    "rotary": ("servo", "rotary"),
    "piezo": ("piezo-100um", "piezo"),
    "wire": ("wire-100um", "wire"),
    "xy": ("xy-plotter", "xy"),
}
EVERY = pytest.mark.parametrize("one", compositions.MACHINES, ids=lambda one: one.name)
QUICKLY = {"kiln": 0, "hall": 1}  # procedures of the thesis, the quickest first


@pytest.fixture
def file(one: Any, tmp_path: Path) -> Path:
    """Its settings."""
    name = FILES[one.name][0]
    text = f'machine = "{one.name}"\n'
    if name:
        text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    return tmp_path / "m.toml"


def command(file: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return macromicro(*words, "--config", file, cwd=file.parent)


def procedure(one: Any) -> str:
    """A laboratory procedure of a machine."""
    if one is compositions.TWO_STAGE:
        return min((p.name for p in PROCEDURES), key=lambda name: QUICKLY.get(name, 9))
    kind = "axis" if one.name == machines.JOINT else one.name
    return next(p.name for p in collecting.PROCEDURES if kind in p.machines)


def test_every_machine_has_its_line_here() -> None:
    assert set(FILES) == {one.name for one in compositions.MACHINES}


@EVERY
@pytest.mark.slow  # a minute for each of some machines: all their commands
def test_its_commands_work(one: Any, file: Path) -> None:
    said = {}
    for words in (
        ("config", "show"),
        ("export", "list"),
        ("doctor",),
        ("run", "--out", "ran"),
        ("collect", procedure(one), "--out", "collected"),
        ("robust", "--samples", "10", "--out", "robust"),
        ("tune", FILES[one.name][1], "--evaluations", "30", "--out", "tuned"),
    ):
        done = command(file, *words)
        said[words[0]] = (done.returncode, done.stdout, done.stderr)
        assert "Traceback" not in done.stderr, done.stderr
    # What was drawn may not meet all requirements, and thirty designs need not be better ones.
    codes = {name: code for name, (code, _, _) in said.items()}
    assert codes.pop("robust") in {0, 1} and codes.pop("doctor") in {0, 1}, said
    assert set(codes.values()) == {0}, {n: s for n, s in said.items() if s[0] != 0}
    assert (file.parent / "ran" / "recording.h5").is_file()
    assert list((file.parent / "collected").rglob("*.h5"))
    assert any((file.parent / "robust").iterdir())
    assert any((file.parent / "tuned").iterdir())
    assert len(said["export"][1].splitlines()) >= 4


@EVERY
@pytest.mark.slow  # compiled with its live loop
def test_it_is_served(one: Any, file: Path) -> None:
    with served(file.parent, file.read_text(encoding="utf-8")) as client:
        assert client.ask("*IDN?")
        assert client.ask("SYST:LOCK:REQ?") == "1"
        assert client.ask("ENAB;*OPC?") == "1"
        client.fine()
