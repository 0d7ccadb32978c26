"""`macromicro run` and `config show` for machines of one stage, from the command line."""

import json
import os
import re
from pathlib import Path

import pytest

from macromicro import ArrivalWarning, cli
from macromicro.machines import machine, performing, planning, results, runs
from macromicro.recording import Recording
from macromicro.runs import job
from macromicro.runs.job import Stop
from tests.command import BARE

EXAMPLES = sorted((Path(__file__).parents[2] / "examples/machines").glob("[!x]*.toml"))
LATE = {"axis": 0.05, "rotary": 0.05, "piezo": 0.5, "wire": 1.0}  # s after the profile's end
WARM_UP = 1.0  # s more for the first move of a cold wire
PROGRAMME = '[[moves]]\nmacro = ["2 mm", "0 mm"]\nhold = "0.05 s"\n'


def called(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["macromicro", *map(str, words)])
    return cli.main()


@pytest.fixture
def files(tmp_path):
    (tmp_path / "m.toml").write_text('machine = "axis"\n[load]\npayload = "0.2 kg"\n')
    (tmp_path / "p.toml").write_text(PROGRAMME)
    return tmp_path


def test_a_run_writes_its_folder(files, monkeypatch, capsys):
    words = (*BARE, files / "p.toml", "--config", files / "m.toml", "--out", files / "out")
    assert called(monkeypatch, *words, "--figures", "png,svg", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    out = files / "out"
    assert {p.name for p in out.iterdir()} == {
        "recording.h5",
        "summary.json",
        "report.html",
        *(f"{name}.{kind}" for name in ("response", "moves") for kind in ("png", "svg")),
    }
    assert json.loads((out / "summary.json").read_text()) == told
    assert told["machine"] == "axis" and told["finished"] and told["fault"] is None
    assert told["overrides"]["load.payload"] == "0.2 kg"
    assert [m["target"] for m in told["moves"]] == pytest.approx([2.0, 0.0], abs=0.01)
    assert all(m["arrived_s"] is not None for m in told["moves"])
    page = (out / "report.html").read_text()
    assert "on the machine axis" in page and "payload" in page and "2 of 2 moves arrived" in page
    recording = Recording.load(out / "recording.h5")
    assert recording.attributes["machine"] == "axis"
    assert recording.attributes["settings"].startswith('machine = "axis"')
    assert recording["target"].max() == pytest.approx(2.0, abs=0.01)
    assert called(monkeypatch, *words) == 2  # the folder is not empty
    assert called(monkeypatch, *words, "--overwrite") == 0
    shown = capsys.readouterr().out
    assert "peak error true peak" in shown and "true error" in shown


def test_a_run_without_figures(files, monkeypatch):
    words = (*BARE, files / "p.toml", "--config", files / "m.toml", "--out", files / "out")
    assert called(monkeypatch, *words, "--figures", "none") == 0
    names = {p.name for p in (files / "out").iterdir()}
    assert names == {"recording.h5", "summary.json", "report.html"}
    assert "<img" not in (files / "out/report.html").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--fan",), "no fan"),
        (("--rig", "replay:x.h5"), "only the two-stage machine can replay"),
        (("--cycles", "0"), "--cycles"),
    ],
)
def test_what_it_does_not_know_is_refused(files, monkeypatch, capsys, words, said):
    run = (*BARE, files / "p.toml", "--config", files / "m.toml", "--out", files / "out")
    assert called(monkeypatch, *run, *words) == 2
    assert said in capsys.readouterr().err and not (files / "out").exists()


def test_runs_that_name_no_folder_get_one_each(files, monkeypatch, capsys):
    monkeypatch.chdir(files)
    run = (*BARE, "p.toml", "--config", "m.toml")
    assert called(monkeypatch, *run) == called(monkeypatch, *run) == 0
    folders = [line for line in capsys.readouterr().out.splitlines() if line.startswith("results")]
    assert folders == ["results: results/p", "results: results/p-2"]
    first = (files / "results/p/recording.h5").stat().st_mtime_ns
    assert called(monkeypatch, *run, "--overwrite") == 0
    assert (files / "results/p/recording.h5").stat().st_mtime_ns > first
    assert called(monkeypatch, *run, "--out", "results/p") == 2
    assert sorted(p.name for p in (files / "results").iterdir()) == ["p", "p-2"]


@pytest.mark.parametrize("words", ["export c two_stage.pid", "response --count 2"])
def test_other_commands_that_name_no_folder_get_one_each(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        assert called(monkeypatch, *words.split()) == 0
    one, two = [x.split(": ")[1] for x in capsys.readouterr().out.splitlines() if "results: " in x]
    assert two == f"{one}-2" and (tmp_path / two).is_dir()


def test_a_fault_ends_the_run_with_words_and_status_1(files, monkeypatch, capsys):
    (files / "m.toml").write_text('machine = "axis"\n[guard]\nerror = "1 um"\n')
    run = (*BARE, files / "p.toml", "--config", files / "m.toml", "--out", files / "out")
    assert called(monkeypatch, *run) == 1
    said = capsys.readouterr().err
    assert "The stage does not follow its set point" in said and "allowed 0.001 mm" in said
    recording = Recording.load(files / "out/recording.h5")
    assert recording["phase"][-1] == 4 and recording["effort"][-1] == 0.0
    assert "Fault: following error" in (files / "out/report.html").read_text()


def test_a_move_that_does_not_arrive_is_reported(files, monkeypatch, capsys):
    text = 'machine = "axis"\n[arrival]\ndwell = "1 s"\npatience = "10 ms"\n'
    (files / "m.toml").write_text(text)
    run = (*BARE, files / "p.toml", "--config", files / "m.toml", "--out", files / "out")
    assert called(monkeypatch, *run) == 1
    told = capsys.readouterr()
    assert "moves 1, 2 did not arrive within 0.01 s" in told.err
    (line,) = [line for line in told.out.splitlines() if "moves arrived" in line]
    assert re.fullmatch(
        rf"0 of 2 moves arrived; worst [0-9.]+ [un]m \(move [12]\); open {files}/out/report.html",
        line,
    )


def test_a_run_in_memory_that_does_not_arrive_warns_of_its_moves_once(files):
    text = 'machine = "axis"\n[arrival]\ndwell = "1 s"\npatience = "10 ms"\n'
    (files / "m.toml").write_text(text)
    made, settings = machine.load(files / "m.toml")
    with pytest.warns(ArrivalWarning) as caught:
        runs.record(made, settings, planning.usual(settings))
    (one,) = caught
    assert "did not arrive; the worst stopped" in str(one.message)
    assert "arrival.patience" in str(one.message) and one.filename == __file__


def test_a_run_stopped_from_outside_keeps_its_recording(files):
    asked = job.Request(config=files / "m.toml", out=files / "out", cycles=9)

    def stop(t, move):
        raise Stop

    with pytest.raises(Stop):
        job.execute(job.check(asked), stop)
    recording = Recording.load(files / "out" / "recording.h5")
    assert len(recording) == performing.CHUNK and not recording.attributes["finished"]


def test_names_that_are_no_utf_8_lose_no_results(files, monkeypatch):
    """As on a disk that another system has written, or where the locale says ASCII."""
    odd = os.fsdecode(b"\xff")
    for name in ("p", "m"):
        (files / f"{name}.toml").rename(files / f"{name}{odd}.toml")
    run = ("run", files / f"p{odd}.toml", "--config", files / f"m{odd}.toml")
    assert called(monkeypatch, *run, "--out", files / odd) == 0
    made = {path.name for path in (files / odd).iterdir()}
    assert {"recording.h5", "summary.json", "report.html"} < made
    assert called(monkeypatch, "plot", files / odd, "position", "--out", files / f"{odd}.html") == 0
    both = ("compare", files / odd, files / odd, "--out", files / f"c{odd}")
    assert called(monkeypatch, *both) == 0


def test_its_settings_are_shown(monkeypatch, capsys, tmp_path):
    assert called(monkeypatch, "config", "show", "--machine", "axis") == 0
    shown = capsys.readouterr().out
    axis = machine.MACHINES[0]
    assert shown == machine.as_toml(axis, axis.settings) and "[motor]" in shown
    assert called(monkeypatch, "config", "show", "motor", "--machine", "axis") == 0
    assert capsys.readouterr().out.startswith("[motor]")
    name = str(next(path for path in EXAMPLES if path.stem == "stage"))
    assert called(monkeypatch, "config", "show", "load", "--config", name) == 0
    of_file = machine.load(Path(name))
    assert capsys.readouterr().out == machine.as_toml(*of_file, "load")
    assert of_file[1].load != axis.settings.load
    (tmp_path / "s.toml").write_text('[bench.friction]\ncoulomb = "11 N"\n')
    words = ("bench.friction", "--config", str(tmp_path / "s.toml"))
    assert called(monkeypatch, "config", "show", *words) == 0
    assert 'coulomb = "11 N"' in capsys.readouterr().out
    assert called(monkeypatch, "config", "show", "--machine", "axle") == 2
    assert "one of two_stage, xy, axis" in capsys.readouterr().err


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_the_examples_run_with_the_gains_that_follow_from_their_sheets(path):
    made = job.check(job.Request(config=path, out=Path("unused")))
    done = runs.record(made.setup.machine, made.settings, made.programme)
    assert done.outcome.finished and done.outcome.fault is None
    most = made.settings.arrival.tolerance * made.setup.machine.kind.place.per
    place = made.setup.machine.kind.place
    for m in results.moves(done.recording, made.setup.plan, made.settings.arrival, place):
        late = LATE[made.setup.machine.name]
        if made.setup.machine.name == "wire" and m.move == 0:
            late += WARM_UP
        assert m.arrived_s is not None and m.arrived_s < m.profile_s + late
        assert abs(m.rest_error) <= most
        assert m.true_peak_error > 0.0 and m.true_error is not None


def test_there_are_examples():
    assert len(EXAMPLES) >= 3
