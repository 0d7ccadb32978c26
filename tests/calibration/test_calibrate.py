"""Calibrations through the command, the page and Python: measured, corrected, verified."""

from __future__ import annotations

import json
import math
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any, NamedTuple

import numpy as np
import pytest
from tests.command import BARE, command

from macromicro.calibration import checking, efforts, files, measuring, procedure
from macromicro.calibration.procedure import Calibration, Request
from macromicro.calibration.references import INSTRUMENTS, Instrument
from macromicro.calibration.request import ready
from macromicro.machines import compositions, programmes, runs
from macromicro.recording import Recording

EXAMPLES = Path(__file__).parents[2] / "examples" / "machines"
SCREW = (EXAMPLES / "screw.toml").read_text(encoding="utf-8")
LYING = (
    SCREW.replace('backlash = "4 um"', 'backlash = "50 um"')
    .replace('error = "3 um"', 'error = "30 um"')
    .replace('incline = "90 deg"', 'incline = "0 deg"')
)
WARM = '\n[climate]\nrise = "10 K"\ntime = "60 s"\nexpansion = "12e-6 1/K"\nsensor = 1\n'
TRUTH = Instrument("truth", 0.0, 0.0)


class Calibrated(NamedTuple):
    file: Path  # of the machine, with its calibration
    out: Path  # results of the command
    answer: dict[str, Any]


def run(*words: str | Path, cwd: Path) -> CompletedProcess[str]:
    return command("calibrate", *words, cwd=cwd)


@pytest.fixture(scope="module")
def screw(tmp_path_factory: pytest.TempPathFactory) -> Calibrated:
    """`screw.toml`, calibrated by the command."""
    folder = tmp_path_factory.mktemp("screw")
    plain, out = folder / "plain.toml", folder / "results"
    plain.write_text(SCREW, encoding="utf-8")
    words = ("--positions", "20", "--runs", "2", "--out", out, "--json")
    done = run("--config", plain, *words, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == json.loads((out / "calibration.json").read_text("utf-8"))
    answer = json.loads((out / "calibration.json").read_text("utf-8"))
    file = folder / "screw.toml"
    file.write_text(f'include = "results/calibration.toml"\n{SCREW}', encoding="utf-8")
    return Calibrated(file, out, answer)


def truly(found: Calibration, settings: Any = None) -> np.ndarray[Any, Any]:
    """True errors at rest at positions of their own, um."""
    judged = found.request._replace(reference=TRUTH, seed=99)
    machine, own = measuring.ready(found.request.machine, settings or found.settings)
    return np.abs(1e6 * procedure.verify(machine, own, judged).deviation)


def test_the_screw_is_where_it_says_to_2_um(screw: Calibrated) -> None:
    machine, settings = compositions.load(screw.file)
    request = Request(machine, settings, TRUTH, positions=20, runs=2, seed=5)
    after = np.abs(1e6 * procedure.verify(machine, settings, request).deviation)
    off = compositions.load(screw.file.with_name("plain.toml"))
    before = np.abs(1e6 * procedure.verify(*procedure.without_corrections(*off), request).deviation)
    assert np.quantile(before, 0.95) > 10.0
    assert np.quantile(after, 0.95) < 2.0
    half = 1e6 * settings.correction.half_width
    assert np.mean(after <= half) >= 0.9


def test_the_page_and_the_numbers_say_what_was_found(screw: Calibrated) -> None:
    page = (screw.out / "calibration.html").read_text("utf-8")
    assert "bidirectional accuracy" in page and "laser interferometer" in page
    rows = {row["symbol"]: row for row in screw.answer["table"]}
    assert rows["A"]["before"] > 10.0 and 0.0 < rows["A"]["after"] < 4.0
    assert rows["A"]["unit"] == "um" and rows["±"]["before"] is None
    (wave,) = [line for line in screw.answer["errors"] if line["name"] == "periodic error"]
    assert wave["value"] == pytest.approx(3.0, abs=3.0 * wave["half"])
    header, *lines = (screw.out / "readings.csv").read_text("utf-8").splitlines()
    assert header == ("pass,run,direction,t_s,temperature_degC,target_mm,reading_mm,reference_mm")
    assert {line.split(",")[0] for line in lines} == {"before", "fit", "after"}


def test_a_run_records_position_and_reading(screw: Calibrated, tmp_path: Path) -> None:
    done = command(*BARE, "--config", screw.file, "--out", "r", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    recording = Recording.load(tmp_path / "r" / "recording.h5")
    held = recording["phase"] == 2
    off = 1e3 * np.abs(recording["true_position"] - recording["target"])[held]
    raw = 1e3 * np.abs(recording["true_position"] - recording["reading"])[held]
    assert np.median(off) < 1.5 and np.median(raw) > 5.0


def test_it_holds_until_the_machine_is_another(screw: Calibrated, tmp_path: Path) -> None:
    done = run("--config", screw.file, "--check", cwd=tmp_path)
    assert done.returncode == 0 and "the calibration holds" in done.stdout, done.stderr
    worn = tmp_path / "worn.toml"
    include = f'include = "{screw.out / "calibration.toml"}"\n'
    worn.write_text(include + SCREW.replace('error = "3 um"', 'error = "9 um"'), encoding="utf-8")
    done = run("--config", worn, "--check", "--json", cwd=tmp_path)
    assert done.returncode == 1
    (axis,) = json.loads(done.stdout)["axes"]
    assert not axis["holds"] and axis["half_width"] > axis["promised"]


def calibrated(text: str, folder: Path, **fields: Any) -> Calibration:
    file = folder / "machine.toml"
    file.write_text(text, encoding="utf-8")
    machine, settings = compositions.load(file)
    return procedure.calibrate(
        Request(machine, settings, INSTRUMENTS["laser"], **{"positions": 24, "runs": 2} | fields)
    )


@pytest.mark.slow
def test_from_both_sides_with_backlash_pitch_error_and_warmth(tmp_path: Path) -> None:
    found = calibrated(LYING + WARM, tmp_path)
    (axis,) = found.axes
    estimates = {each.name: each for each in axis.fit.estimates}
    assert estimates["reversal"].value == pytest.approx(-50e-6, abs=4e-6)
    for name, true in (("periodic error", 30e-6), ("expansion", 12e-6)):
        each = estimates[name]
        assert each.value == pytest.approx(true, abs=2.0 * each.half)
    assert np.quantile(truly(found), 0.95) < 3.0
    degrees = found.measured.temperature
    assert axis.correction.cold < degrees.min() and axis.correction.hot > degrees.max()


def test_a_check_of_another_stage_fails(tmp_path: Path) -> None:
    found = calibrated(LYING, tmp_path)
    machine, settings = found.request.machine, found.settings
    other = settings._replace(drive=settings.drive._replace(backlash=20e-6))
    request = found.request._replace(settings=settings, bench=other)
    assert not checking.check(request).axes[0].holds
    assert checking.check(request._replace(bench=None)).axes[0].holds
    assert machine.name == "axis"


@pytest.mark.slow
def test_squareness_and_reversals_of_two_axes(tmp_path: Path) -> None:
    text = (EXAMPLES / "xy-plotter.toml").read_text(encoding="utf-8")
    found = calibrated(text, tmp_path, positions=9, runs=3, reversals=True)
    x, y = found.axes
    high = x.correction.across_high - x.correction.across_low
    slant = x.correction.across[-1] - x.correction.across[0]
    assert slant == pytest.approx(-high * math.radians(0.01), rel=0.1)
    assert x.correction.other == "y" and y.name == "y"
    assert np.quantile(truly(found), 0.95) < 1.5
    off = contour(found, [own._replace(turn_effort=0.0, turn_damping=0.0) for own in both(found)])
    assert contour(found, both(found)) < 0.8 * off
    assert all(turn.after < 0.7 * turn.before for turn in found.turns)
    assert "x error after reversals" in files.text(found)


def both(found: Calibration) -> list[Any]:
    return [own.correction for own in found.request.machine.trees(found.settings)]


def contour(found: Calibration, corrections: list[Any]) -> float:
    """Greatest true distance from the example circle, m."""
    machine, settings = procedure.with_corrections(
        found.request.machine, found.settings, corrections
    )
    plan = programmes.plan(machine, settings, programmes.choose(machine, settings))
    recording = runs.record(machine, settings, plan, warn=False).recording
    (leg,) = (k for k, leg in enumerate(plan.legs) if leg.name == "arc")
    own = (recording["move"] == leg) & (recording["phase"] == 1)
    middle = 0.5 * settings.y.travel.high
    x, y = (1e-3 * recording[f"true_{name}"][own] - middle for name in "xy")
    return float(np.max(np.abs(np.hypot(x, y) - 0.8 * middle)))


LINEAR = """machine = "axis"
[motor]
constant = "20 N*m/A"
[drive]
kind = "linear"
cogging = "4 N"
cogging_period = "24 mm"
[friction]
coulomb = "8 N"
[encoder]
at = "load"
pitch = "0.5 um"
"""


def test_slow_passes_learn_the_cogging(tmp_path: Path) -> None:
    found = calibrated(LINEAR, tmp_path, positions=6, cogging=True)
    (ripple,) = found.ripple
    machine, settings = procedure.without_corrections(found.request.machine, found.request.settings)
    smooth = settings._replace(drive=settings.drive._replace(cogging=0.0))
    least = efforts.passes(machine, settings, bench=smooth).ripple
    # Beside what counts and friction do without any cogging.
    assert ripple.after**2 - least**2 < (ripple.before**2 - least**2) / 16.0
    assert least < 4e-6 and ripple.before < 12e-6  # the start from rest does not count
    correction = found.settings.correction
    assert correction.effort_period == pytest.approx(24e-3, rel=0.01)
    assert math.hypot(*correction.effort_waves[:2]) == pytest.approx(4.0 / 20.0, rel=0.05)


def test_the_own_sensor_shows_the_backlash_where_friction_does(tmp_path: Path) -> None:
    lying, hanging = tmp_path / "lying.toml", tmp_path / "hanging.toml"
    lying.write_text(LYING, encoding="utf-8")
    hanging.write_text(SCREW, encoding="utf-8")
    words = ("--reference", "none", "--json")
    done = run("--config", lying, *words, "--out", "a", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    wound_up = 2.0 * (8.0 + 2.0) / (4.0 * (2.0 * math.pi * 180.0) ** 2)  # by friction, m
    assert found["backlash"] == pytest.approx(50.0 + 1e6 * wound_up, abs=3.0)
    assert "down = [" in (tmp_path / "a" / "calibration.toml").read_text("utf-8")
    done = run("--config", hanging, *words, "--out", "b", cwd=tmp_path)
    assert done.returncode == 0
    found = json.loads(done.stdout)
    assert found["backlash"] is None and "takes a reference" in found["remarks"][0]


def test_the_two_stage_machine_has_tables_of_its_own(tmp_path: Path) -> None:
    done = run(cwd=tmp_path)
    assert done.returncode == 2 and "identify hall" in done.stderr


def test_bad_requests_name_the_option(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    file.write_text(SCREW, encoding="utf-8")
    for words, told in (
        (("--positions", "2"), "--positions"),
        (("--runs", "1"), "--runs"),
        (("--reference", "autocollimator"), "--reference"),
        (("--period", "5"), "--period"),
        (("--check",), "no corrections"),
        (("--reversals",), "--reversals"),
        (("--rig", "twin+twin"), "--rig"),
    ):
        done = run("--config", file, *words, cwd=tmp_path)
        assert done.returncode == 2 and told in done.stderr, (words, done.stderr)


def test_a_reference_of_a_rig_is_needed() -> None:
    request = ready(EXAMPLES / "screw.toml", "scale", positions=7)
    assert request.reference.title == "glass scale" and request.positions == 7
