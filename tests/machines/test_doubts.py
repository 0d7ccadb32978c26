"""Derived settings that say little are named where they are shown; nothing is judged by them."""

import json
import tomllib

import pytest

from macromicro import cli
from macromicro.machines import doubts, machine
from macromicro.machines.compositions import MACHINES, TWO_STAGE
from tests.command import BARE

BELT = 'machine = "axis"\ndrive = {kind = "belt", frequency = "20 Hz", damping = 0.01}\n'
COARSE = 'machine = "axis"\nencoder.lines = 12\n'
PAIR = 'machine = "xy"\nx.drive = {kind = "belt", frequency = "20 Hz", damping = 0.01}\n'
TURNED = 'machine = "rotary"\nencoder.counts = 12\n'
SET = 'arrival.tolerance = "0.2 mm"\n'


def called(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["macromicro", *map(str, words)])
    return cli.main()


@pytest.fixture(params=[(BELT, "drive.frequency"), (COARSE, "counts of the encoder")])
def doubtful(request, tmp_path):
    (tmp_path / "m.toml").write_text(request.param[0])
    return tmp_path, request.param[1]


def test_a_derived_tolerance_far_above_the_encoder_or_coarse_is_shown_with_its_reason(
    doubtful, monkeypatch, capsys
):
    folder, reason = doubtful
    config = ("--config", folder / "m.toml")
    assert called(monkeypatch, "config", "show", *config) == 0
    shown = capsys.readouterr().out
    warning = shown.splitlines()[0]
    assert warning.startswith("# warning: arrival.tolerance = 4") and reason in warning
    assert tomllib.loads(shown)["machine"] == "axis"
    assert called(monkeypatch, "config", "show", "motion", *config) == 0
    assert "warning" not in capsys.readouterr().out
    assert called(monkeypatch, *BARE, *config, "--out", folder / "out", "--json") == 0
    (told,) = json.loads(capsys.readouterr().out)["warnings"]
    assert told == warning.removeprefix("# warning: ")
    page = (folder / "out/report.html").read_text()
    assert reason in page
    assert "of 4 moves arrived, but arrival.tolerance = 4" in page and "is in doubt" in page


def test_no_gains_are_searched_by_a_tolerance_in_doubt(doubtful, monkeypatch, capsys):
    folder, reason = doubtful
    tune = ("tune", "axis", "--config", folder / "m.toml", "--out", folder / "t")
    assert called(monkeypatch, *tune, "--evaluations", "10") == 2
    said = capsys.readouterr().err
    assert "m.toml, arrival.tolerance" in said and "set in the file" in said and reason in said
    assert not (folder / "t").exists()


def test_a_tolerance_that_is_set_is_in_no_doubt(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text(BELT + SET)
    words = ("--config", tmp_path / "m.toml", "--out", tmp_path / "t", "--evaluations", "10")
    assert called(monkeypatch, "tune", "axis", *words) == 0
    assert called(monkeypatch, "config", "show", "--config", tmp_path / "m.toml") == 0
    assert "warning" not in capsys.readouterr().out


def test_of_two_axes_the_one_in_doubt_is_named_and_the_path_follows(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text(PAIR)
    config = ("--config", tmp_path / "m.toml")
    assert called(monkeypatch, "config", "show", *config) == 0
    first, second = capsys.readouterr().out.splitlines()[:2]
    assert first.startswith("# warning: x.arrival.tolerance = ") and "20 Hz" in first
    assert second.startswith("# warning: path.tolerance = ") and "x.arrival.tolerance" in second
    assert called(monkeypatch, "config", "show", *config, "--axis", "x") == 0
    assert capsys.readouterr().out.startswith("# warning: arrival.tolerance = ")
    assert called(monkeypatch, "tune", "xy", *config, "--out", tmp_path / "t") == 2
    assert "x.arrival.tolerance" in capsys.readouterr().err


def test_a_stage_that_turns_counts_in_degrees(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text(TURNED)
    assert called(monkeypatch, "config", "show", "--config", tmp_path / "m.toml") == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith("# warning: arrival.tolerance = ") and "deg follows" in first


@pytest.mark.parametrize("one", [c for c in MACHINES if c is not TWO_STAGE], ids=lambda c: c.name)
def test_no_machine_as_it_comes_is_in_doubt(one):
    assert doubts.find_doubts(one.settings) == ()


@pytest.mark.parametrize("one", MACHINES, ids=lambda c: c.name)
def test_units_of_all_settings_are_spelt_one_way(one):
    assert "**" not in machine.as_toml(one, one.settings)
