"""`macromicro reproduce` as a user meets it: what it leaves, says and exits with."""

from __future__ import annotations

import csv
import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from macromicro import cli
from macromicro.drawing import exhibit
from macromicro.thesis import reproduce
from macromicro.thesis.procedure import Lab
from tests.command import command as macromicro
from tests.systems import posix
from tests.warm import Command

COMMAND = [sys.executable, "-m", "macromicro", "reproduce"]


def command(*arguments: str | Path, cwd: Path, **more: str) -> subprocess.CompletedProcess[str]:
    return macromicro("reproduce", *arguments, cwd=cwd, env=more)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """Two quick procedures and one claim of a third."""
    place = tmp_path_factory.mktemp("reproduced")
    names = ("--only", "technologies", "Table C.1", "I5")
    return place, command(*names, "--jobs", "2", cwd=place)


def test_leaves_page_table_figures_and_json(
    done: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    place, finished = done
    assert finished.returncode == 0, finished.stderr
    out = place / "results" / "reproduction"
    assert {p.name for p in out.iterdir()} == {
        "reproduction.html",
        "claims.json",
        "claims.csv",
        "figures",
    }
    assert {p.name for p in (out / "figures").iterdir()} >= {
        "figure-6-6.png",
        "table-2-1.csv",
        "table-c-1.csv",
    }
    rows = json.loads((out / "claims.json").read_text(encoding="utf-8"))
    assert [r["id"] for r in rows] == ["D9", "D10", "I5"]
    assert all(isinstance(r["measured"], float | list) for r in rows)
    with (out / "claims.csv").open(encoding="utf-8", newline="") as file:
        assert [r["id"] for r in csv.DictReader(file)] == ["D9", "D10", "I5"]


def test_prints_a_table_and_where_the_page_is(
    done: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    _, finished = done
    assert "3 claims: 3 reproduced" in finished.stdout
    assert "page: results/reproduction/reproduction.html" in finished.stdout
    assert "laser-noise: done" in finished.stderr


def test_an_existing_folder_is_refused_and_kept(
    done: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    place, _ = done
    page = place / "results" / "reproduction" / "reproduction.html"
    before = page.read_bytes()
    refused = command("--only", "D9", "--out", "results/reproduction", cwd=place)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "already exists" in refused.stderr
    assert page.read_bytes() == before


def test_overwrite_replaces_all_of_it_and_figures_have_other_formats(
    done: tuple[Path, subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    out = tmp_path / "r"
    shutil.copytree(done[0] / "results" / "reproduction", out)
    before = out / "figures" / "table-c-1.csv"
    assert before.exists()
    words = ("--only", "I5", "--out", "r", "--figures", "pdf", "--overwrite")
    assert command(*words, cwd=tmp_path).returncode == 0
    assert (out / "figures" / "figure-6-6.pdf").read_bytes().startswith(b"%PDF")
    assert not before.exists() and not list((out / "figures").glob("*.png"))
    assert "data:image/png;base64," in (out / "reproduction.html").read_text()
    assert len(json.loads((out / "claims.json").read_text())) == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--only", "Z9"], "'Z9'"),
        (["--only", "M1", "Z9"], "'Z9'"),
        (["--jobs", "0"], "--jobs"),
        (["--seed", "-1"], "--seed"),
        (["--rig", "no_such_module:rig"], "no_such_module"),
        (["--out", "a_file"], "a file"),
    ],
)
def test_bad_input_is_one_message_and_writes_nothing(
    tmp_path: Path, arguments: list[str], words: str
) -> None:
    (tmp_path / "a_file").write_text("mine")
    refused = command(*arguments, cwd=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert words in refused.stderr
    assert refused.stdout == ""
    assert [p.name for p in tmp_path.iterdir()] == ["a_file"]
    assert (tmp_path / "a_file").read_text() == "mine"


def test_json_to_standard_output_is_nothing_else(tmp_path: Path) -> None:
    finished = command("--only", "D9", "--json", cwd=tmp_path)
    assert [r["id"] for r in json.loads(finished.stdout)] == ["D9"]


RIG = '''
class Clock:
    def now(self): return 0.0
    def wait(self, dt): ...


class Half:
    """A bench without a laser."""

    channels = ("t", "encoder", "hall", "extend", "contract")
    clock = Clock()

    def read(self): ...
    def write(self, outputs): ...
    def stop(self): ...
    def __enter__(self): return self
    def __exit__(self, *error): ...


def half(seed):
    return Half()
'''


def test_a_rig_without_the_channel_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mylab.py").write_text(RIG)
    refused = command("--only", "I5", "--rig", "mylab:half", cwd=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "laser" in refused.stderr
    assert "mylab:half" in refused.stderr


def test_a_figure_that_cannot_be_drawn_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The claims stay as they were measured, the page says what is missing, the exit is 1."""

    def run(chosen: list[reproduce.Chosen], lab: Lab, *_: object) -> list[reproduce.Result]:
        """In this process, where nothing can be drawn."""
        return [reproduce.narrow(c, reproduce.run_one(c.procedure, lab)) for c in chosen]

    def broken(*figure: object) -> bytes:
        raise ValueError("no ink")

    monkeypatch.setattr(reproduce, "run", run)
    monkeypatch.setattr(exhibit, "encode", broken)
    monkeypatch.chdir(tmp_path)
    words = ["macromicro", "reproduce", "--only", "technologies"]
    monkeypatch.setattr(sys, "argv", words)
    assert cli.main() == 1
    said = capsys.readouterr()
    note = "Table 6.2 (plot) was not drawn: ValueError: no ink"
    assert f"macromicro: technologies: {note}" in said.err
    assert "Traceback" not in said.err
    assert note in said.out
    rows = json.loads((tmp_path / "results/reproduction/claims.json").read_text())
    assert [(r["id"], r["verdict"]) for r in rows] == [("D9", "reproduced"), ("D10", "reproduced")]
    page = (tmp_path / "results/reproduction/reproduction.html").read_text(encoding="utf-8")
    assert page.count(note) == 2
    assert "Table 6.1" in page


@posix
def test_interrupted_keeps_what_was_done(tmp_path: Path) -> None:
    """Ctrl-C once the first procedure has ended: a page with it, the others not measured."""
    names = ("--only", "sensor-design", "laser-noise", "--jobs", "1")
    with Command(
        [*COMMAND, *names], cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as running:
        assert running.stderr is not None
        line = running.stderr.readline()
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=120)
    first = line.partition(":")[0]
    assert running.returncode == 130, errors
    rows = json.loads((tmp_path / "results" / "reproduction" / "claims.json").read_text())
    assert len(rows) == 10
    done = {"laser-noise": {"I5", "I7"}, "sensor-design": {"D1", "D2"}}[first]
    assert {r["id"] for r in rows if r["verdict"] == "reproduced"} >= done
    assert "interrupted" in errors


def test_list_names_every_claim(tmp_path: Path) -> None:
    listed = command("--list", cwd=tmp_path)
    assert listed.returncode == 0
    assert "M4a" in listed.stdout
    assert "Table 6.1" in listed.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_all_of_it(tmp_path: Path) -> None:
    """Sixty claims, most reproduced, the others explained; every figure on the page."""
    finished = command("--out", "all", cwd=tmp_path)
    assert finished.returncode == 0, finished.stderr
    rows = json.loads((tmp_path / "all" / "claims.json").read_text())
    assert len(rows) == 60
    assert sum(r["verdict"] == "reproduced" for r in rows) >= 55
    assert all(r["reason"] for r in rows if r["verdict"] != "reproduced")
    assert all(r["measured"] is not None for r in rows)
    page = (tmp_path / "all" / "reproduction.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") >= 60
    assert "http://" not in page.replace("http://www.w3.org", "")
