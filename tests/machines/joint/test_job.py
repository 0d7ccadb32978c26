"""`macromicro run` and `config show` for two axes, from the command line."""

import json
from pathlib import Path

import numpy as np
import pytest

from macromicro import ArrivalWarning, cli
from macromicro.errors import InputError
from macromicro.machines import compositions, machine, performing, results, runs
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.settings import DEFAULT
from macromicro.recording import Recording
from macromicro.runs import folder, job
from macromicro.runs.job import Request, Stop
from tests.command import BARE

EXAMPLE = Path(__file__).parents[3] / "examples/machines/xy-plotter.toml"
PATHS = """
title = "corner"
[[paths]]
points = [["4 mm", "0 mm"], ["4 mm", "3 mm"]]
rounding = "1 mm"
hold = "0.05 s"
[[paths]]
centre = ["2 mm", "3 mm"]
angle = "90 deg"
"""


def called(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["macromicro", *map(str, words)])
    return cli.main()


@pytest.fixture
def files(tmp_path):
    (tmp_path / "m.toml").write_text('machine = "xy"\n[y.load]\npayload = "0.2 kg"\n')
    (tmp_path / "p.toml").write_text(PATHS)
    return tmp_path


def asked(files, *more):
    return (*BARE, files / "p.toml", "--config", files / "m.toml", "--out", files / "out", *more)


def test_a_run_writes_its_folder(files, monkeypatch, capsys):
    assert called(monkeypatch, *asked(files, "--figures", "png,svg", "--json")) == 0
    told = json.loads(capsys.readouterr().out)
    out = files / "out"
    assert {p.name for p in out.iterdir()} == {
        "recording.h5",
        "summary.json",
        "report.html",
        *(f"{name}.{kind}" for name in ("path", "axes") for kind in ("png", "svg")),
    }
    assert json.loads((out / "summary.json").read_text()) == told
    assert told["machine"] == "xy" and told["finished"] and told["fault"] is None
    assert told["overrides"]["y.load.payload"] == "0.2 kg"
    assert told["overrides"]["x.load.payload"] == "1.7 kg"
    corner, arc = told["moves"]
    assert corner["target"] == pytest.approx([4.0, 3.0])
    assert corner["way"] == pytest.approx(7.0 - 2.0 + np.pi / 2.0)
    assert arc["target"] == pytest.approx([2.0, 5.0]) and arc["way"] == pytest.approx(np.pi)
    for move in told["moves"]:
        assert move["arrived_s"] >= move["profile_s"] > 0.0
        beside = move["contour"]
        assert 0.0 < beside["rms"] <= beside["peak"] < 0.1
        assert set(move["axes"]) == {"x", "y"} and move["axes"]["x"]["peak_error"] > 0.0
    page = (out / "report.html").read_text()
    assert "on the machine xy" in page and "contour rms" in page and "x carries y" in page
    recording = Recording.load(out / "recording.h5")
    assert recording.attributes["settings"].startswith('machine = "xy"')
    assert recording["x_target"].max() == pytest.approx(4.0)
    assert called(monkeypatch, *asked(files)) == 2  # the folder is not empty
    assert called(monkeypatch, *asked(files, "--overwrite", "--cycles", "2")) == 0
    said = capsys.readouterr().out
    assert (
        "contour: by the encoders at most" in said and " 5 " in said
    )  # between the cycles it goes back


def test_the_headline_judges_the_true_contour_beside_that_of_the_encoders(
    files, monkeypatch, capsys
):
    text = 'machine = "xy"\nhidden.squareness = "0.1 deg"\npath.tolerance = "40 um"\n'
    (files / "m.toml").write_text(text)
    (files / "p.toml").write_text('[[moves]]\nx = "0 mm"\ny = "100 mm"\nhold = "0.2 s"\n')
    assert called(monkeypatch, *asked(files)) == 0
    (headline,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("contour: ")]
    encoders, true, tolerance = headline.split("; ")
    assert encoders.startswith("contour: by the encoders at most ")
    assert ", within the tolerance, rms " in encoders
    assert true.startswith("true at most ") and ", beyond the tolerance, rms " in true
    assert float(true.split()[3]) == pytest.approx(1e5 * np.radians(0.1), rel=0.1)
    assert tolerance == "tolerance 40 um"
    assert "true at most" in (files / "out/report.html").read_text()


def test_the_contour_is_measured_on_the_recording(files):
    made = job.check(Request(str(files / "p.toml"), files / "out", files / "m.toml"))
    ended = job.execute(made)
    r, found = ended.recording, ended.moves[1].contour
    part = results.under_way(r, made.setup.plan, 1)
    out = np.hypot(r["x_position"][part] - 2.0, r["y_position"][part] - 3.0) - 2.0
    inside = (r["x_position"][part] > 2.05) & (r["y_position"][part] > 3.05)
    assert found.peak >= np.abs(out[inside]).max() > 0.0
    assert found.peak == pytest.approx(np.abs(out).max(), rel=0.5)
    assert found.rms < found.peak


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--fan",), "no fan"),
        (("--rig", "replay:x.h5"), "--rig"),
        (("--cycles", "0"), "--cycles"),
        (("--law", "cascade"), "x.law and y.law"),
        (("--seed", "-1"), "--seed"),
    ],
)
def test_what_it_does_not_know_is_refused(files, monkeypatch, capsys, words, said):
    assert called(monkeypatch, *asked(files, *words)) == 2
    assert said in capsys.readouterr().err and not (files / "out").exists()


def test_a_programme_for_one_stage_is_refused(files, monkeypatch, capsys):
    (files / "p.toml").write_text('[[moves]]\nmacro = "2 mm"\nhold = "1 s"\n')
    assert called(monkeypatch, *asked(files)) == 2
    assert "move 1, macro: unknown key. Accepted: one of x, y" in capsys.readouterr().err


def test_a_fault_of_one_axis_ends_the_run_with_words_and_status_1(files, monkeypatch, capsys):
    (files / "m.toml").write_text('machine = "xy"\n[y.guard]\nerror = "0.1 um"\n')
    assert called(monkeypatch, *asked(files)) == 1
    said = capsys.readouterr().err
    assert "Axis y: The stage does not follow its set point" in said and "both axes" in said
    recording = Recording.load(files / "out/recording.h5")
    assert recording["phase"][-1] == 4
    assert recording["x_effort"][-1] == 0.0 == recording["y_effort"][-1]
    assert "Fault: following error" in (files / "out/report.html").read_text()


def test_a_move_of_which_one_axis_does_not_arrive_is_reported(files, monkeypatch, capsys):
    text = 'machine = "xy"\n[x.arrival]\npatience = "10 ms"\n[y.arrival]\ndwell = "1 s"\n'
    (files / "m.toml").write_text(text + 'patience = "20 ms"\n')
    assert called(monkeypatch, *asked(files)) == 1
    told = capsys.readouterr()
    assert "moves 1, 2 did not arrive within 0.02 s" in told.err
    assert "0 of 2 moves arrived; worst " in told.out
    found, settings = compositions.load(files / "m.toml")
    plan = planning.plan(course.load(files / "p.toml"), settings)
    with pytest.warns(ArrivalWarning, match="^moves 1, 2 did not arrive; the worst stopped "):
        runs.record(found, settings, plan)


def test_a_run_stopped_from_outside_keeps_its_recording(files):
    def stop(t, move):
        raise Stop

    asked = job.check(Request(config=files / "m.toml", out=files / "out", cycles=3))
    with pytest.raises(Stop):
        job.execute(asked, stop)
    kept = Recording.load(files / "out" / folder.RECORDING)
    assert len(kept) == performing.CHUNK
    assert results.of(asked.setup.machine, kept, asked.setup.plan, asked.settings)


def test_its_settings_are_shown(files, monkeypatch, capsys):
    assert called(monkeypatch, "config", "show", "--machine", "xy") == 0
    shown = capsys.readouterr().out
    assert shown.startswith('machine = "xy"') and "[y.motor]" in shown
    assert called(monkeypatch, "config", "show", "x.motor", "--machine", "xy") == 0
    assert capsys.readouterr().out.startswith("[x.motor]")
    assert called(monkeypatch, "config", "show", "--axis", "y", "--config", files / "m.toml") == 0
    (files / "y.toml").write_text(capsys.readouterr().out)
    found, tree = machine.load(files / "y.toml")
    assert found.name == "axis" and tree == DEFAULT.with_("y.load.payload", "0.2 kg").y
    assert (
        called(monkeypatch, "config", "show", "y.load.payload", "--config", files / "m.toml") == 0
    )
    assert capsys.readouterr().out.startswith('[y.load]\npayload = "0.2 kg"')
    for words, said in (
        (("--axis", "z"), "--axis: 'z'; accepted: x or y"),
        (("--machine", "xy", "--config", files / "m.toml"), "not allowed with --config"),
        (("--machine", "xy", "--law", "cascade"), "--law"),
    ):
        assert called(monkeypatch, "config", "show", *words) == 2
        assert said in capsys.readouterr().err


def test_what_takes_one_stage_says_how_to_get_one_axis(files):
    with pytest.raises(InputError, match=r"config show --config FILE --axis x.* one axis"):
        machine.load(files / "m.toml")


def test_the_example_keeps_its_tolerance_with_the_gains_of_its_sheets():
    made = job.check(Request(config=EXAMPLE, out=Path("unused")))
    done = runs.record(made.setup.machine, made.settings, made.setup.plan)
    assert done.outcome.finished and done.outcome.fault is None
    moves = results.of(made.setup.machine, done.recording, made.setup.plan, made.settings)
    assert len(moves) == 10 and all(m.arrived_s is not None for m in moves)
    assert max(m.contour.peak for m in moves) < 1e3 * made.settings.path.tolerance
    # What the encoders do not see: the corner that is farthest up leans by the squareness.
    lean = np.sin(made.settings.hidden.squareness) * moves[2].target[1]
    assert moves[2].true_error == pytest.approx(lean, abs=1e-3)
