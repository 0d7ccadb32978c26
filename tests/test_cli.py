"""The command line as a user meets it: what it prints, leaves behind and exits with."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from macromicro import cli
from macromicro.recording import Recording
from macromicro.runs.folder import FILES, PAGE, RECORDING, SUMMARY
from tests.command import BARE
from tests.command import command as macromicro
from tests.systems import linux, posix
from tests.warm import Command

COMMAND = [sys.executable, "-m", "macromicro"]
SHORT = '[[moves]]\nmacro = ["20 mm"]\nmicro = ["1 mm"]\nhold = "1.2 s"\n'
LONG = '[[moves]]\nmicro = "1 mm"\nhold = "1500 s"\n'


def command(*arguments: str | Path, cwd: Path, **more: str) -> subprocess.CompletedProcess[str]:
    return macromicro(*arguments, cwd=cwd, env=more)


@pytest.fixture
def short(tmp_path: Path) -> Path:
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """A short run that went well, without --out."""
    place = tmp_path_factory.mktemp("done")
    (place / "short.toml").write_text(SHORT)
    return place, command("run", "short.toml", "--seed", "2", cwd=place)


# --- a good run


def test_exits_with_0_and_leaves_everything(
    done: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    place, finished = done
    assert finished.returncode == 0, finished.stderr
    out = place / "results" / "short"
    made = {p.name for p in out.iterdir()}
    assert {RECORDING, SUMMARY, PAGE, "response.png"} <= made <= set(FILES)
    summary = json.loads((out / SUMMARY).read_text())
    recording = Recording.load(out / RECORDING)
    assert recording.attributes["seed"] == summary["seed"] == 2
    assert len(recording) * 1e-3 == pytest.approx(summary["simulated_s"])
    assert recording["phase"][-1] == 4  # done: all outputs safe
    assert recording["motor"][-1] == recording["ctrl"][-1] == 0.0


def test_prints_a_line_a_move(done: tuple[Path, subprocess.CompletedProcess[str]]) -> None:
    _, finished = done
    lines = finished.stdout.splitlines()
    assert all(word in lines[0] for word in ("arrival", "error at rest", "overshoot"))
    assert lines[1].split()[1:4] == ["macro", "20", "mm"]
    assert lines[2].split()[1:4] == ["micro", "1000", "um"]
    assert any(line.startswith("speed:") for line in lines)
    said = [line for line in lines if line.startswith("2 of 2 moves arrived; worst ")]
    assert len(said) == 1 and said[0].endswith("; open results/short/report.html")
    assert lines[-1] == "results: results/short"
    assert len(finished.stderr.splitlines()) <= 3


def test_json_is_all_that_stdout_gets(short: Path, tmp_path: Path) -> None:
    finished = command(*BARE, short, "--json", "--out", tmp_path / "o", "--fan", cwd=tmp_path)
    assert finished.returncode == 0, finished.stderr
    summary = json.loads(finished.stdout)
    assert summary == json.loads((tmp_path / "o" / SUMMARY).read_text())
    assert summary["fan"] is True and summary["seed"] == 0


@pytest.mark.slow
def test_same_seed_same_recording_bit_for_bit(
    done: tuple[Path, subprocess.CompletedProcess[str]], short: Path, tmp_path: Path
) -> None:
    for name, seed in (("b", "2"), ("c", "6")):
        assert command(*BARE, short, "--out", name, "--seed", seed, cwd=tmp_path).returncode == 0
    folders = (done[0] / "results" / "short", tmp_path / "b", tmp_path / "c")
    a, b, c = (Recording.load(folder / RECORDING) for folder in folders)
    assert all(a[col.name].tobytes() == b[col.name].tobytes() for col in a.columns)
    assert a.attributes == b.attributes
    assert a["laser"].tobytes() != c["laser"].tobytes()


# --- runs that end badly


def test_a_fault_exits_with_1_and_says_what_to_do(short: Path, tmp_path: Path) -> None:
    (tmp_path / "hot.toml").write_text('[guard]\nhottest = "45 degC"\n')
    finished = command(*BARE, short, "--config", "hot.toml", "--out", "o", cwd=tmp_path)
    assert finished.returncode == 1
    assert "45 degC" in finished.stderr and "cool" in finished.stderr
    summary = json.loads((tmp_path / "o" / SUMMARY).read_text())
    assert summary["finished"] is False
    assert set(summary["fault"]) >= {"code", "message", "evidence", "remedy"}
    assert summary["moves"][-1]["complete"] is False
    assert summary["overrides"] == {"guard.hottest": "45 degC"}
    recording = Recording.load(tmp_path / "o" / RECORDING)
    assert recording["phase"][-1] == 5
    assert recording["motor"][-1] == recording["ctrl"][-1] == 0.0
    assert summary["fault"]["evidence"] in (tmp_path / "o" / PAGE).read_text()


def test_a_move_that_does_not_arrive_exits_with_1(tmp_path: Path) -> None:
    (tmp_path / "hasty.toml").write_text('[[moves]]\nmicro = ["3 mm", "0.5 mm"]\nhold = "0.1 s"\n')
    finished = command(*BARE, "hasty.toml", cwd=tmp_path)
    assert finished.returncode == 1
    assert "1, 2 did not arrive" in finished.stderr


# --- interruption


def started(*arguments: str | Path, cwd: Path, until: str, **more: str) -> subprocess.Popen[str]:
    """A run in the background, once it has said `until`; with a cache of its own a new Python."""
    how = subprocess.Popen if more else Command
    process = how(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONUNBUFFERED": "1", **more},
    )
    assert process.stderr is not None
    for line in process.stderr:
        if until in line:
            return process
    raise AssertionError(f"ended with {process.wait()} before it said {until!r}")


@posix
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupted_run_keeps_its_recording(
    tmp_path: Path, number: signal.Signals, status: int
) -> None:
    (tmp_path / "long.toml").write_text(LONG)
    process = started(*BARE, "long.toml", "--out", "o", cwd=tmp_path, until="running")
    time.sleep(0.4)
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == status, errors
    assert "Traceback" not in errors and "interrupted" in errors
    assert errors.count("\n") == 1 and "the recording is in o" in errors
    recording = Recording.load(tmp_path / "o" / RECORDING)
    assert 0 < len(recording) < 1_500_000
    assert (recording["move"] == 0).all() and not recording.attributes["finished"]
    assert [path.name for path in (tmp_path / "o").iterdir()] == [RECORDING]


@posix
def test_interrupted_while_compiling_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text(LONG)
    process = started(
        "run",
        "long.toml",
        "--out",
        "o",
        cwd=tmp_path,
        until="compiling",
        MACROMICRO_CACHE=str(tmp_path / "cache"),
    )
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert not (tmp_path / "o").exists()


# --- the folder


def test_existing_folder(
    done: tuple[Path, subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    place = tmp_path / "again"
    shutil.copytree(done[0], place)
    out = place / "results" / "short"
    (out / "note.txt").write_text("mine")
    (out / "cycles.png").write_text("of an earlier run")
    before = (out / RECORDING).read_bytes()
    refused = command(*BARE, "short.toml", "--out", "results/short", cwd=place)
    assert refused.returncode == 2 and "--overwrite" in refused.stderr
    assert (out / RECORDING).read_bytes() == before
    replaced = command("run", "short.toml", "--overwrite", "--seed", "9", cwd=place)
    assert replaced.returncode == 0, replaced.stderr
    assert json.loads((out / SUMMARY).read_text())["seed"] == 9
    assert (out / "note.txt").read_text() == "mine"
    assert not (out / "cycles.png").exists()


@pytest.mark.slow
def test_figures_in_other_formats(
    done: tuple[Path, subprocess.CompletedProcess[str]], short: Path, tmp_path: Path
) -> None:
    """Those asked for alone, and those of an earlier run are gone; the page has its own."""
    shutil.copytree(done[0] / "results" / "short", tmp_path / "r")
    words = ("run", short.name, "--out", "r", "--figures", "svg,pdf", "--overwrite")
    again = command(*words, cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    made = {p.name for p in (tmp_path / "r").iterdir()}
    assert {"response.svg", "response.pdf"} <= made <= set(FILES)
    assert not any(name.endswith(".png") for name in made)
    assert "data:image/png;base64," in (tmp_path / "r" / PAGE).read_text()


@pytest.mark.parametrize("words", ["run", "reproduce", "robust", "tune macro"])
def test_other_formats_of_figures_are_refused(words: str, tmp_path: Path) -> None:
    """Before anything is computed."""
    done = command(*words.split(), "--figures", "png,gif", cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "--figures: 'gif'; accepted: png, svg, pdf" in done.stderr
    assert not list(tmp_path.iterdir())


@linux
def test_a_folder_that_cannot_be_made(short: Path, tmp_path: Path) -> None:
    for place in (short, short / "below", Path("/proc/nowhere")):
        finished = command(*BARE, short, "--out", place, "--overwrite", cwd=tmp_path)
        assert finished.returncode == 2, finished.stderr
        assert str(place) in finished.stderr and "Traceback" not in finished.stderr
    assert short.read_text() == SHORT


# --- bad input: exit status 2, one message that names place, value and remedy, no folder

MOVE = '[[moves]]\nmicro = "1 mm"\nhold = "1 s"\n'
BAD_PROGRAMMES = {
    "unknown key": ("a.toml", MOVE + 'wait = "1 s"\n', ["a.toml", "wait", "hold"]),
    "missing unit": ("a.toml", MOVE.replace("1 mm", "1"), ["a.toml", "move 1", "micro", "1", "mm"]),
    "wrong unit": ("a.toml", MOVE.replace("1 mm", "1 V"), ["a.toml", "micro", "1 V", "mm"]),
    "out of range": ("a.toml", MOVE.replace("1 mm", "4 mm"), ["a.toml", "micro", "4 mm", "3.9 mm"]),
    "macro out of range": (
        "a.toml",
        MOVE.replace('micro = "1 mm"', 'macro = "201 mm"'),
        ["macro", "201 mm", "200 mm"],
    ),
    "NaN": ("a.toml", MOVE.replace('"1 mm"', "nan"), ["a.toml", "micro", "nan"]),
    "NaN with a unit": ("a.toml", MOVE.replace("1 mm", "nan mm"), ["a.toml", "micro", "nan mm"]),
    "NaN in a cell": ("a.csv", "t_s,micro_mm\n0,nan\n1,1\n", ["a.csv", "line 2", "nan"]),
    "times stand still": (
        "a.csv",
        "t_s,micro_mm\n0,1\n1,1\n1,1\n",
        ["a.csv", "line 4", "1 s", "increase"],
    ),
    "unknown column": ("a.csv", "t_s,micro_in\n0,1\n", ["a.csv", "line 1", "micro_in", "micro_mm"]),
    "empty": ("a.toml", "", ["a.toml", "empty"]),
    "bad UTF-8": ("a.toml", b"title = '\xff'\n", ["a.toml", "0xff", "UTF-8"]),
    "bad TOML": ("a.toml", "[[moves]\n", ["a.toml", "line 1"]),
    "unknown suffix": ("a.txt", MOVE, ["a.txt", ".txt", ".toml"]),
}
BAD_CONFIGS = {
    "unknown key": ("[bench.friction]\ncolomb = '9 N'\n", ["colomb", "coulomb"]),
    "missing unit": ("[bench.friction]\ncoulomb = 9\n", ["bench.friction.coulomb", "9", "N"]),
    "wrong unit": ("[bench.friction]\ncoulomb = '9 mm'\n", ["bench.friction.coulomb", "9 mm", "N"]),
    "NaN": ("[bench.friction]\ncoulomb = 'nan N'\n", ["bench.friction.coulomb", "nan N"]),
    "negative mass": (
        "[bench.carriage]\nmass = '-1 kg'\n",
        ["bench.carriage.mass", "-1 kg", "above"],
    ),
    "stop beyond the stroke": ("[bench.wire]\nstop = '9 mm'\n", ["bench.wire.stop", "stroke"]),
    "empty": ("\n", ["empty"]),
}
BAD_OPTIONS = {
    "no cycles": (["--cycles", "0"], ["--cycles", "0", "1"]),
    "cycles in words": (["--cycles", "two"], ["--cycles", "two"]),
    "too many cycles": (["--cycles", "10000000"], ["--cycles", "10000000"]),
    "seed in words": (["--seed", "1.5"], ["--seed", "1.5", "whole"]),
    "negative seed": (["--seed", "-1"], ["--seed", "-1", "0"]),
    "unknown option": (["--speed", "2"], ["--speed"]),
    "no such programme": (["thesus"], ["thesus", "thesis"]),
    "a directory": (["."], ["this is a folder"]),
    "no such config": (["--config", "none.toml"], ["none.toml", "no such file"]),
    "a directory as config": (["--config", "."], ["this is a folder"]),
}


def refused(arguments: list[str], parts: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """`macromicro run` in this process: status 2, one message, nothing left behind."""
    before = sorted(Path.cwd().rglob("*"))
    sys.argv = ["macromicro", "run", *arguments]
    assert cli.main() == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    said = [
        line for line in captured.err.splitlines() if line and not line.startswith(("Usage", "Try"))
    ]
    assert len(said) == 1, captured.err
    for part in parts:
        assert part in said[0]
    assert sorted(Path.cwd().rglob("*")) == before


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", sys.argv)
    yield tmp_path


@pytest.mark.parametrize("kind", BAD_PROGRAMMES)
def test_bad_programme(kind: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name, text, parts = BAD_PROGRAMMES[kind]
    (here / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    refused([name], parts, capsys)


@pytest.mark.parametrize("kind", BAD_CONFIGS)
def test_bad_config(kind: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, parts = BAD_CONFIGS[kind]
    (here / "c.toml").write_text(text)
    refused(["--config", "c.toml"], ["c.toml", *parts], capsys)


@pytest.mark.parametrize("kind", BAD_OPTIONS)
def test_bad_option(kind: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments, parts = BAD_OPTIONS[kind]
    refused(arguments, parts, capsys)


def test_bad_input_in_a_process_of_its_own(tmp_path: Path) -> None:
    finished = command("run", "--cycles", "0", cwd=tmp_path)
    assert finished.returncode == 2
    assert "--cycles" in finished.stderr and "Traceback" not in finished.stderr
    assert list(tmp_path.iterdir()) == []


# --- everything else


def test_config_show(tmp_path: Path) -> None:
    shown = command("config", "show", cwd=tmp_path)
    assert shown.returncode == 0
    assert "[bench.friction]" in shown.stdout and "bench assumption" in shown.stdout
    part = command("config", "show", "bench.friction.coulomb", cwd=tmp_path)
    assert part.returncode == 0 and "coulomb" in part.stdout and "N" in part.stdout
    assert command("config", "show", "bench.frictoin", cwd=tmp_path).returncode == 2


def test_programmes(tmp_path: Path) -> None:
    listed = command("programmes", cwd=tmp_path)
    assert listed.returncode == 0 and len(listed.stdout.splitlines()) >= 3
    printed = command("programmes", "thesis", cwd=tmp_path)
    assert "Chapter 6" in printed.stdout and "[[moves]]" in printed.stdout
    unknown = command("programmes", "nothing", cwd=tmp_path)
    assert unknown.returncode == 2 and "thesis" in unknown.stderr


def test_version(tmp_path: Path) -> None:
    import macromicro

    assert command("--version", cwd=tmp_path).stdout.split() == [
        "macromicro",
        macromicro.__version__,
    ]


@pytest.mark.parametrize("key", ["live", "serve", "live.homing", "serve.lost_client"])
def test_config_shows_what_only_the_live_machine_has(tmp_path: Path, key: str) -> None:
    """And `macromicro serve --config` takes it back."""
    from macromicro.serve.settings import LiveSettings, load

    shown = command("config", "show", key, cwd=tmp_path)
    assert shown.returncode == 0, shown.stderr
    (tmp_path / "mine.toml").write_text(shown.stdout)
    assert load(tmp_path / "mine.toml") == LiveSettings()


def test_config_shows_what_the_server_of_any_machine_has(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "axis.toml").write_text('machine = "axis"\nserve.lost_client = "hold"\n')
    sys.argv = ["macromicro", "config", "show", "serve.lost_client", "--config", "axis.toml"]
    assert cli.main() == 0
    assert 'lost_client = "hold"' in capsys.readouterr().out
