"""The measured frequency response, against the linear model and by hand."""

import json

import numpy as np
import pytest

from macromicro import cli
from macromicro.errors import InputError
from macromicro.machines import loops, machine, sheets, sweeping
from macromicro.report import bode

AXIS = machine.MACHINES[0]
# Fine counts, so that nothing but the linear machine and its friction is left.
FINE = AXIS.settings.with_(
    {"encoder.at": "load", "encoder.pitch": "0.05 um", "encoder.rate": "1e8 counts/s"}
)


def model(settings):
    return lambda f: sheets.plant(settings, f)


@pytest.fixture(scope="module")
def found():
    frequency = sweeping.frequencies(8.0, 200.0, 8, FINE.timing.period)
    return sweeping.measure_response(AXIS, FINE, frequency, model(FINE))


def test_windows_hold_whole_cycles():
    dt = 1e-3
    f = sweeping.frequencies(2.0, 300.0, 50, dt)
    assert 2 <= len(f) <= 50 and np.all(np.diff(f) > 0.0)
    assert f[0] == pytest.approx(2.0, rel=0.01) and f[-1] == pytest.approx(300.0, rel=0.01)
    for each in f:
        periods = sweeping._window(each, dt)
        assert periods * each * dt == pytest.approx(round(periods * each * dt), abs=1e-6)
        assert periods * dt >= 0.29 and round(periods * each * dt) >= 4
    for wrong in ((0.0, 10.0, 5), (20.0, 10.0, 5), (1.0, 451.0, 5), (1.0, 10.0, 1)):
        with pytest.raises(InputError, match="frequencies"):
            sweeping.frequencies(*wrong, dt)


def test_the_plant_is_that_of_the_sheets(found):
    share = found.plant / sheets.plant(FINE, found.frequency)
    assert np.abs(share) == pytest.approx(1.0, abs=0.02)
    assert np.degrees(np.angle(share)) == pytest.approx(0.0, abs=2.0)
    assert found.loop == pytest.approx(found.plant * found.law)
    assert np.all(found.moved > 0.0)


def test_a_lighter_load_answers_more(found):
    light = FINE.with_("load.mass", "0.25 kg")._replace(controller=FINE.controller)
    one = sweeping.measure_response(AXIS, light, found.frequency[-2:-1], model(light))
    ratio = (0.25 + sheets.turning(FINE)) / (0.5 + sheets.turning(FINE))
    assert abs(found.plant[-2] / one.plant[0]) == pytest.approx(ratio, rel=0.03)


def test_a_loop_that_is_not_stable_is_said_to_be_so():
    gains = FINE.controller._replace(velocity=12.0 * FINE.controller.velocity)
    wild = FINE._replace(controller=gains)
    with pytest.raises(InputError, match=r"response at 50 Hz.*the effort reaches its limit"):
        sweeping.measure_response(AXIS, wild, np.array([50.0]), model(wild))


def test_the_command_writes_numbers_and_a_bode_plot(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text('machine = "axis"\n')
    words = ["macromicro", "response", "--config", str(tmp_path / "m.toml"), "--count", "12"]
    words += ["--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", words)
    assert cli.main() == 0
    said = capsys.readouterr().out
    assert "measured: crossover" in said and "linear model: crossover" in said
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"response.json", "bode.png"}
    told = json.loads((tmp_path / "out/response.json").read_text())
    measured, linear = told["margins"]["measured"], told["margins"]["model"]
    assert measured["crossover"] == pytest.approx(linear["crossover"], rel=0.05)
    assert measured["phase"] == pytest.approx(linear["phase"], abs=4.0)
    assert linear["phase"] > 35.0 and linear["gain"] > 2.5  # of the gains that follow
    assert len(told["frequency_hz"]) == len(told["loop"]["gain"]) <= 12
    monkeypatch.setattr("sys.argv", [*words, "--overwrite", "--low", "900"])
    assert cli.main() == 2


@pytest.mark.parametrize("config", [None, 'machine = "two_stage"\n'])
def test_without_a_machine_the_command_shows_the_macro_stage(config, tmp_path, monkeypatch, capsys):
    """The margins of (4.10) with (4.4): 4.91 rad/s and 85.7 deg (Section 4.3.3 and its erratum)."""
    words = ["macromicro", "response", "--out", str(tmp_path / "out")]
    if config:
        (tmp_path / "m.toml").write_text(config)
        words += ["--config", str(tmp_path / "m.toml")]
    monkeypatch.setattr("sys.argv", words)
    assert cli.main() == 0
    said = capsys.readouterr().out
    assert "macro-stage, linear model (4.4) under pd-tuned: crossover 0.7815 Hz" in said
    assert "phase margin 85.7 deg" in said and "UNSTABLE" not in said
    told = json.loads((tmp_path / "out/response.json").read_text())
    assert told["margins"]["model"]["stable"] is True and len(told["frequency_hz"]) == 60
    assert (tmp_path / "out/bode.png").stat().st_size > 5_000
    for more in (["--low", "900"], ["--count", "-3"]):
        monkeypatch.setattr("sys.argv", [*words, "--overwrite", *more])
        assert cli.main() == 2


def test_a_loop_that_is_not_stable_is_called_so():
    """The loop of the axis with ten times its gain, and as it is."""
    f = np.geomspace(0.5, 450.0, 400)
    law = loops.law(FINE.controller, f, FINE.timing.period)
    response = sweeping.Response(f, sheets.plant(FINE, f), law, sheets.plant(FINE, f) * law, f)
    good = bode.Found(AXIS, FINE, response, response.plant, 0)
    assert not any("UNSTABLE" in line for line in good.lines())
    wild = response._replace(loop=10.0 * response.loop, law=10.0 * law)
    said = good._replace(measured=wild).lines()
    assert all(line.endswith("the closed loop is UNSTABLE") for line in said[:2])
    phase = good._replace(measured=wild).margins[0].phase
    assert -180.0 < phase <= 0.0


def test_only_what_the_encoder_sees_is_compared(found):
    made = bode.Found(AXIS, FINE, found, sheets.plant(FINE, found.frequency), 0)
    assert made.seen.all()
    blind = made._replace(measured=found._replace(moved=0.0 * found.moved))
    assert not blind.seen.any() and len(blind.lines()) == len(made.lines()) - 1
