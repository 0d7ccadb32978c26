"""`identify` and `collect` as a person meets them: files in, table, figures, model.toml out."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from macromicro import cli
from macromicro.commands import identify as command
from macromicro.control.calibration import default_calibration
from macromicro.hysteresis.table_files import load_table
from macromicro.identify import Axis, simulate
from macromicro.recording import Recording
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.thesis import collecting
from tests.command import BARE
from tests.systems import posix

DATA = Path(__file__).parents[1] / "examples/data"
DOCS = Path(__file__).parents[1] / "docs"


class Ended(NamedTuple):
    status: int
    out: str
    err: str


Macromicro = Callable[..., Ended]


@pytest.fixture
def macromicro(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Macromicro:
    """The command line in this process."""

    def call(*words: object) -> Ended:
        monkeypatch.setattr(sys, "argv", ["macromicro", *map(str, words)])
        capsys.readouterr()
        status = cli.main()
        return Ended(status, *capsys.readouterr())

    return call


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recordings of all procedures on the twin, a folder for each, made when asked for."""
    return tmp_path_factory.mktemp("lab")


def collected(lab: Path, name: str, macromicro: Macromicro) -> Path:
    place = lab / name
    if not place.exists():
        done = macromicro("collect", name, "--out", place)
        assert done.status == 0, done.err
        assert done.out.splitlines()[-1].startswith("then: macromicro identify ")
    return place


def values(text: str) -> dict[str, float]:
    return {line["name"]: line["value"] for line in json.loads(text)["values"]}


def drive_csv(place: Path, axis: Axis, name: str = "own.csv") -> Path:
    """What a rig recorded: pulses, 2 ms apart, position in steps of 5 um."""
    random = np.random.default_rng(3)
    pulses = [np.full(random.integers(50, 150), random.uniform(-5.0, 5.0)) for _ in range(25)]
    volts = np.concatenate(pulses)
    x = 5e-3 * np.round(simulate(axis, 4.0 * volts, 2e-3) / 5e-6)
    t = 2.0 * np.arange(len(x))
    path = place / name
    rows = np.column_stack([t, volts, x])
    np.savetxt(path, rows, delimiter=",", header="t_ms,u_V,x_mm", comments="")
    return path


OWN = Axis(mass=1.2, viscous=14.0, coulomb=3.0, offset=0.4)


# --- drive


@pytest.mark.slow
def test_own_csv_without_out_is_printed_and_nothing_is_written(
    macromicro: Macromicro, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    drive_csv(tmp_path, OWN)
    done = macromicro("identify", "drive", "own.csv", "--gain", "4")
    assert (done.status, done.err) == (0, "")
    assert [p.name for p in tmp_path.iterdir()] == ["own.csv"]
    row = next(line.split() for line in done.out.splitlines() if line.startswith("mass"))
    assert float(row[1]) == pytest.approx(1.2, rel=0.02) and "kg" in row[3:5]
    assert 0.0 < float(row[2]) < 0.1
    fit = re.search(r"^fit: free run ([\d.]+) %", done.out, re.MULTILINE)
    assert fit is not None and float(fit[1]) > 80.0, done.out


def test_json_is_all_that_stdout_gets(macromicro: Macromicro, tmp_path: Path) -> None:
    path = drive_csv(tmp_path, OWN)
    fit = ("drive", path, "--gain", "4", "--structure", "coulomb")
    done = macromicro("identify", *fit, "--json")
    content = json.loads(done.out)
    found = values(done.out)
    for name in ("mass", "viscous", "coulomb", "offset"):
        line = next(x for x in content["values"] if x["name"] == name)
        assert found[name] == pytest.approx(getattr(OWN, name), abs=4.0 * line["error"])
    assert content["kind"] == "drive" and content["files"] == [str(path)]
    assert content["warnings"] == []


@pytest.mark.slow
def test_emps_from_a_mat_file(macromicro: Macromicro, tmp_path: Path) -> None:
    """Published (Janot et al. 2019): 95.1089 kg, 203.5034 N s/m, 20.3935 N."""
    from scipy.io import savemat

    with np.load(DATA / "emps/emps.npz", allow_pickle=False) as copy:
        x = 50e-9 * np.cumsum(copy["position"].astype(np.int64))
        content = {"qm": x, "vir": 2e-4 * copy["volts"], "gtau": float(copy["gain"])}
    savemat(tmp_path / "emps.mat", {**content, "t": np.arange(len(x)) * 1e-3})
    done = macromicro(
        *("identify", "drive", tmp_path / "emps.mat", "--columns", "x=qm:m", "u=vir:V"),
        *("--structure", "coulomb", "--json"),
    )
    assert done.status == 0, done.err
    content = json.loads(done.out)
    inverse = content["data"]["inverse"]
    assert inverse["mass"] == pytest.approx(95.1089, rel=0.01)
    assert inverse["viscous"] == pytest.approx(203.5034, rel=0.01)
    assert inverse["coulomb"] == pytest.approx(20.3935, rel=0.02)
    assert content["data"]["method"] == "inverse dynamics"  # the surer one: forces disturb it
    assert content["values"][0]["unit"] == "kg"
    assert content["values"][0]["value"] == inverse["mass"]
    assert "gtau in the file" in content["remarks"]["gain"]


@pytest.mark.slow
def test_the_twin_s_drive_gives_settings_that_run(
    macromicro: Macromicro, lab: Path, tmp_path: Path
) -> None:
    """What is identified in counts and volts is near what the bench was made with, and a
    programme runs on it."""
    place = collected(lab, "drive", macromicro)
    out = tmp_path / "out"
    done = macromicro("identify", "drive", place / "drive.h5", "--out", out)
    # Beyond the period that the file tells the motor's inductance and a belt are late.
    assert done.status == 0 and done.err.count("\n") == 1
    assert "the force acts 1 ms (1 sample) later than u" in done.err
    assert {p.name for p in out.iterdir()} == {
        "result.json", "model.toml", "free_run.png", "residuals.png",
    }  # fmt: skip
    assert (out / "free_run.png").read_bytes().startswith(b"\x89PNG")
    true, found = Settings().bench, config.load_overrides(out / "model.toml", Settings()).bench
    assert found.carriage.mass == pytest.approx(true.carriage.mass, rel=0.1)
    assert found.friction.coulomb == pytest.approx(true.friction.coulomb, rel=0.05)
    assert found.friction.viscous == pytest.approx(true.friction.viscous, rel=0.4)
    changed = config.difference(Settings(bench=found, sensors=Settings().sensors), Settings())
    assert all(path.startswith(("bench.carriage.mass", "bench.friction.")) for path in changed)
    programme = tmp_path / "short.toml"
    programme.write_text('[[moves]]\nmacro = ["20 mm"]\nmicro = ["1 mm"]\nhold = "1.2 s"\n')
    ran = macromicro(*BARE, programme, "--config", out / "model.toml", "--out", tmp_path / "run")
    assert ran.status == 0, ran.err


# --- linear and dead zone


def test_macro_stage_as_section_4_2_5(macromicro: Macromicro, lab: Path, tmp_path: Path) -> None:
    """(4.3): 165.72 / (z - 0.95833), gain 3977 counts/s/V; (4.5): 0.364 V, 0.636."""
    place = collected(lab, "macro-steps", macromicro)
    done = macromicro(
        *("identify", "linear", place / "steps-1V.h5", "--width", "3", "--method", "mls"),
        *("--out", tmp_path / "out", "--json"),
    )
    assert done.status == 0, done.err
    found = values(done.out)
    assert found["a1"] == pytest.approx(-0.95833, abs=0.01)
    assert found["b1"] == pytest.approx(165.72, rel=0.1)
    assert found["gain"] == pytest.approx(3977.0, rel=0.02)
    assert "10 with the same input, averaged" in json.loads(done.out)["remarks"]["records"]
    assert macromicro("run", "--config", tmp_path / "out/model.toml").status == 2
    done = macromicro(
        *("identify", "deadzone", place / "steps-0.1V.h5", place / "steps-1V.h5"),
        *("--gain", found["gain"], "--width", "3", "--json"),
    )
    assert done.status == 0, done.err
    assert values(done.out)["a0"] == pytest.approx(0.364, abs=0.02)
    assert values(done.out)["delta"] == pytest.approx(0.636, abs=0.02)
    assert "already gives uninterrupted motion" in done.err


@pytest.mark.slow
def test_dead_zone_goes_into_the_controller(
    macromicro: Macromicro, lab: Path, tmp_path: Path
) -> None:
    """Section 4.2.3: 3 V."""
    place = collected(lab, "dead-zone", macromicro)
    out = tmp_path / "out"
    done = macromicro("identify", "deadzone", place / "dead-zone.h5", "--out", out)
    assert (done.status, done.err) == (0, "")
    found = config.load_overrides(out / "model.toml", Settings())
    assert found.controller.dead_zone == pytest.approx(3.0, abs=0.051)
    assert {"thresholds.png", "speeds.png"} <= {p.name for p in out.iterdir()}


# --- hysteresis, heat, Hall sensor


def test_forc_table(macromicro: Macromicro, tmp_path: Path) -> None:
    """Every second curve predicts the others within 0.06 % of the range."""
    out = tmp_path / "out"
    done = macromicro("identify", "hysteresis", DATA / "forc/hchb_forc", "--out", out, "--json")
    assert done.status == 0, done.err
    assert values(done.out)["prediction"] < 0.06
    table = load_table(out / "table.h5")
    assert (table.kind, len(table.raw)) == ("ascending", 152)
    np.testing.assert_allclose(load_table(out / "table.csv").values, table.values, atol=1e-15)
    assert {"curves.png", "density.png", "residuals.png"} <= {p.name for p in out.iterdir()}


@pytest.mark.slow
def test_kiln_then_heat(macromicro: Macromicro, lab: Path, tmp_path: Path) -> None:
    """S2: new profiles within 3 % of the stroke. (5.5): 83.2 K at most, (5.6): -1.32 to
    -2.1, and 0.85 s of cooling, as the claims accept them."""
    kiln = collected(lab, "kiln", macromicro)
    out = tmp_path / "kiln"
    tests = [word for k in (1, 2, 3) for word in ("--test", kiln / f"test-{k}.h5")]
    done = macromicro("identify", "hysteresis", kiln / "cycles.h5", *tests, "--out", out)
    assert done.status == 0, done.err
    shares = re.findall(r"prediction of .*: RMS ([\d.]+) % of range", done.out)
    assert len(shares) == 3 and max(map(float, shares)) < 1.0
    heat = collected(lab, "electrothermal", macromicro)
    files = sorted(heat.glob("*.h5"))
    done = macromicro("identify", "thermal", *files, "--table", out / "table.h5", "--json")
    assert done.status == 0, done.err
    found = values(done.out)
    assert found["asymptote b + y0"] == pytest.approx(83.2, abs=2.0)
    assert found["rate 1"] == pytest.approx(1.75, abs=0.4)
    assert found["cooling from 1.575 V"] == pytest.approx(0.9, abs=0.2)
    assert min(found[name] for name in ("c1", "r1", "c2", "r2", "c3", "r3")) > 0.0
    assert "1.65, 1.7, 1.8 V" in json.loads(done.out)["remarks"]["no steady temperature"]


def test_heat_by_a_thermocouple(macromicro: Macromicro, tmp_path: Path) -> None:
    """A measured temperature needs no table: one step and its cooling, known exactly."""
    t = np.arange(0.0, 400.0, 0.05)
    rise = 60.0 * (1.0 - 0.7 * np.exp(-t / 0.5) - 0.2 * np.exp(-t / 8.0) - 0.1 * np.exp(-t / 80.0))
    cooled = np.where(t < 300.0, rise, 60.0 * np.exp(-(t - 300.0) / 4.0))
    volts = np.where(t < 300.0, 2.0, 0.0)
    rows = np.column_stack([t, volts, 20.0 + cooled])
    path = tmp_path / "a.csv"
    np.savetxt(path, rows, delimiter=",", header="t_s,u_V,temperature_C", comments="")
    done = macromicro("identify", "thermal", path, "--json")
    assert done.status == 0, done.err
    found = values(done.out)
    assert found["rise at 2 V"] == pytest.approx(60.0, rel=0.01)
    for k, (tau, share) in enumerate(((0.5, 0.7), (8.0, 0.2), (80.0, 0.1)), 1):
        assert found[f"rate {k}"] == pytest.approx(1.0 / tau, rel=0.1)
        assert found[f"share {k}"] == pytest.approx(share, rel=0.05)
    assert found["cooling from 2 V"] == pytest.approx(4.0, abs=0.06)


def test_hall_writes_a_table_and_says_that_no_setting_holds_it(
    macromicro: Macromicro, lab: Path, tmp_path: Path
) -> None:
    place = collected(lab, "hall", macromicro)
    out = tmp_path / "out"
    done = macromicro("identify", "hall", place / "hall.h5", "--out", out)
    assert (done.status, done.err) == (0, "")
    assert "settings: no setting holds a table" in done.out
    made = np.loadtxt(out / "hall_calibration.csv", delimiter=",", skiprows=2)
    inner = slice(5, -5)
    place = 1e3 * default_calibration().position  # the file is in mm
    np.testing.assert_allclose(made[inner, 1], place[inner], atol=2e-3)
    assert "No setting" in (out / "model.toml").read_text()
    assert macromicro("run", "--config", out / "model.toml").status == 2


def test_a_sensor_that_falls(macromicro: Macromicro, tmp_path: Path) -> None:
    """A sensor mounted the other way round has a falling table."""
    x = np.concatenate([np.linspace(0.0, 4.0, 4000), np.linspace(4.0, 0.0, 4000)])
    rows = np.column_stack([5.0 - 1.2 * x, x])
    path = tmp_path / "a.csv"
    np.savetxt(path, rows, delimiter=",", header="v_V,x_mm", comments="")
    done = macromicro("identify", "hall", path, "--json")
    assert done.status == 0, done.err
    content = json.loads(done.out)
    assert values(done.out)["slope"] == pytest.approx(-1.0 / 1.2, rel=1e-3)
    volts, place = (np.array(content["data"][n]) for n in ("volts", "position_mm"))
    np.testing.assert_allclose(place, (5.0 - volts) / 1.2, atol=2e-3)


def test_curves_of_a_csv(macromicro: Macromicro, tmp_path: Path) -> None:
    """Named by a column or cut out of a record over time: the same table."""
    tops = np.linspace(1.0, 0.2, 9)
    path, series = tmp_path / "curves.csv", tmp_path / "series.csv"
    rows, record = ["curve,u_V,f_mm"], ["t_s,u_V,f_mm"]
    k = 0
    for c, top in enumerate(tops):
        for u in np.r_[np.linspace(0.0, top, 120)[:-1], np.linspace(top, 0.0, 120)]:
            record.append(f"{0.01 * k},{u},{u * u}")
            k += 1
        rows += [f"{c},{u},{u * u}" for u in np.linspace(top, 0.0, 120)]
    path.write_text("\n".join(rows))
    series.write_text("\n".join(record))
    named, cut = (macromicro("identify", "hysteresis", p, "--json") for p in (path, series))
    assert named.status == cut.status == 0, named.err + cut.err
    # Reversible: f = u^2 whatever the past.
    for done in (named, cut):
        assert values(done.out)["output, high"] == pytest.approx(1.0, abs=0.01)
        assert values(done.out)["prediction"] < 1.0
    assert json.loads(cut.out)["data"]["curves"] == 9


# --- bad input


def bad_files(place: Path) -> None:
    """Files that are wrong, each in one way."""
    t = 2.0 * np.arange(2000)
    u = 5.0 * np.sign(np.sin(t / 60.0))
    x = 10.0 * np.sin(t / 300.0)

    def save(name: str, *columns: np.ndarray, heading: str = "t_ms,u_V,x_mm") -> None:
        rows = np.column_stack(columns)
        np.savetxt(place / name, rows, delimiter=",", header=heading, comments="")

    save("columns.csv", t, u, x, heading="a,b,c")
    save("gap.csv", np.where(t > 2000.0, t + 500.0, t), u, x)
    save("back.csv", t[::-1], u, x)
    save("constant.csv", t, np.full_like(t, 2.0), x)
    save("still.csv", t, u, np.full_like(t, 2.0))
    save("few.csv", t[:30], u[:30], x[:30])
    save("rising.csv", t, t, t * t, heading="t_ms,u_V,f_mm")
    save("railed.csv", t, u, np.clip(5.0 * x, -10.0, 10.0))
    save("nan.csv", t, u, np.full_like(t, np.nan))
    (place / "picture.png").write_bytes(b"\x89PNG")
    (place / "folder").mkdir()
    (place / "full").mkdir()
    (place / "full/mine.txt").write_text("mine")


BAD = [
    ("drive columns.csv", "a, b, c"),
    ("drive back.csv", "increase"),
    ("drive constant.csv", "constant at 2"),
    ("drive still.csv", "constant at 0.002"),
    ("drive few.csv", "30 samples"),
    ("drive railed.csv", "saturated"),
    ("drive nan.csv", "missing number"),
    ("drive picture.png", "not known"),
    ("drive folder", "a directory"),
    ("drive nothing.csv", "no such file"),
    ("drive gap.csv --columns x", "name=column"),
    ("drive gap.csv --columns z=x_mm", "one of t, u, x, run"),
    ("drive few.csv --limit -1", "above zero"),
    ("linear still.csv", "zero throughout"),
    ("linear railed.csv --method magic", "output_error"),
    ("linear railed.csv --order 1", "na,nb"),
    ("deadzone constant.csv", "no run at a negative voltage"),
    ("hysteresis rising.csv", "never reverses"),
    ("hysteresis few.csv --columns f=x_mm", "never reverses"),
    ("hysteresis constant.csv --columns f=x_mm", "constant at 2"),
    ("plays constant.csv --columns f=x_mm", "constant at 2"),
    ("plays columns.csv --plays 1 --columns u=b,f=c", "2 to 200"),
    ("thermal constant.csv", "--table"),
    ("thermal constant.csv --table nothing.h5", "no such file"),
    ("hall still.csv", "constant"),
    ("hall few.csv", "no one-way run"),
    ("magic few.csv", "one of drive, carriage, actuator, linear, deadzone, hysteresis, stress"),
]


@pytest.mark.parametrize(("words", "said"), BAD, ids=[words for words, _ in BAD])
def test_bad_input_is_one_message_and_leaves_nothing(
    macromicro: Macromicro,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: str,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    bad_files(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    done = macromicro("identify", *shlex.split(words), "--out", "new")
    assert done.status == 2, done
    assert done.out == ""
    lines = done.err.splitlines()
    assert said in lines[-1], done.err
    assert all(re.match(r"macromicro: \w+Warning: ", line) for line in lines[:-1])
    assert sorted(tmp_path.rglob("*")) == before


def test_out_must_be_free(
    macromicro: Macromicro, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refused before anything is computed; with --overwrite only own files are replaced."""
    monkeypatch.chdir(tmp_path)
    bad_files(tmp_path)
    own = drive_csv(tmp_path, OWN)
    for place, said in (("full", "already exists"), ("few.csv", "a file")):
        done = macromicro("identify", "drive", own, "--out", place)
        assert done.status == 2 and said in done.err
    for name in ("table.h5", "along.png", "branches.svg", "friction.pdf", "stress_map.csv"):
        (tmp_path / "full" / name).write_text("of an earlier identification")
    fit = ("drive", own, "--structure", "coulomb")
    done = macromicro("identify", *fit, "--out", "full", "--overwrite")
    assert done.status == 0
    assert sorted(p.name for p in (tmp_path / "full").iterdir()) == [
        "free_run.png", "mine.txt", "model.toml", "residuals.png", "result.json",
    ]  # fmt: skip


def test_a_failure_while_writing_leaves_no_part(
    macromicro: Macromicro, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk fills up at the second figure."""
    own = drive_csv(tmp_path, OWN)

    def full(*_: object) -> bytes:
        raise OSError(28, "No space left on device", str(tmp_path / "new"))

    monkeypatch.setattr("macromicro.drawing.files.encode", full)
    fit = ("drive", own, "--structure", "coulomb")
    done = macromicro("identify", *fit, "--out", tmp_path / "new")
    assert done.status == 1 and "No space left" in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["own.csv"]


def test_what_was_mended_is_said(macromicro: Macromicro, tmp_path: Path) -> None:
    """Missing rows and uneven times: named warnings, on stderr and in the result."""
    rows = drive_csv(tmp_path, OWN).read_text().splitlines()
    cells = [row.split(",") for row in rows[1:]]
    jitter = np.random.default_rng(0).uniform(-0.4, 0.4, len(cells))
    for k in range(1, len(cells)):
        cells[k][0] = f"{float(cells[k][0]) + jitter[k]:.4f}"
    cells[500][2] = "nan"
    path = tmp_path / "mended.csv"
    path.write_text("\n".join([rows[0], *(",".join(row) for row in cells)]))
    fit = ("drive", path, "--gain", "4", "--structure", "coulomb")
    done = macromicro("identify", *fit, "--json")
    assert done.status == 0, done.err
    assert "MissingRowsWarning: " in done.err and "1 of " in done.err
    assert "ResampledWarning: " in done.err and "interpolated" in done.err
    assert len(json.loads(done.out)["warnings"]) == len(done.err.splitlines()) == 2
    assert values(done.out)["mass"] == pytest.approx(1.2, rel=0.1)


# --- collect


def test_list_names_every_procedure(macromicro: Macromicro) -> None:
    done = macromicro("collect", "--list")
    assert done.status == 0
    for procedure in collecting.PROCEDURES:
        assert procedure.gives in done.out
        words = procedure.then.split()
        assert words[:2] == ["macromicro", "identify"]
        assert words[2] in {c.name or c.callback.__name__ for c in command.app.registered_commands}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("magic", "one of dead-zone"),
        ("", "one of dead-zone"),
        ("drive --rig real", "twin"),
        ("drive --seed -1", "whole number"),
        ("drive --out full", "already exists"),
    ],
)
def test_bad_requests_collect_nothing(
    macromicro: Macromicro,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: str,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full/mine.txt").write_text("mine")
    done = macromicro("collect", *words.split())
    assert done.status == 2 and said in done.err and len(done.err.splitlines()) == 1
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["full", "mine.txt"]


def test_same_seed_same_recordings(macromicro: Macromicro, lab: Path, tmp_path: Path) -> None:
    first = collected(lab, "macro-steps", macromicro)
    for name, seed in (("same", 0), ("other", 1)):
        done = macromicro("collect", "macro-steps", "--seed", seed, "--out", tmp_path / name)
        assert done.status == 0
    one, same, other = (
        Recording.load(p / "steps-1V.h5") for p in (first, tmp_path / "same", tmp_path / "other")
    )
    assert one["macro_position"].tobytes() == same["macro_position"].tobytes()
    assert one["macro_position"].tobytes() != other["macro_position"].tobytes()
    assert one["run"][-1] == 10 and one.attributes == same.attributes
    assert not any(c.name.startswith("true_") for c in one.columns)


# --- help and documents


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['macromicro', 'identify', 'drive', '--help']\n"
        "from macromicro import cli\ncli.main()\n"
        "print([m for m in ('numpy', 'scipy', 'numba', 'h5py', 'matplotlib', 'pint') "
        "if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
    assert "--structure" in done.stdout


def test_document_s_commands_exist(macromicro: Macromicro) -> None:
    """Every command in docs/identify.md names kinds, options and experiments that there are."""
    text = (DOCS / "identify.md").read_text(encoding="utf-8")
    lines = [line.split() for line in re.findall(r"^    macromicro (.*)$", text, re.MULTILINE)]
    assert len(lines) > 10
    helps: dict[str, str] = {}
    for words in lines:
        if words[0] == "collect":
            if "--config" not in words:  # else it is a record of that machine
                collecting.find(words[1])
            continue
        key = " ".join(words[: 2 if words[0] == "identify" else 1])
        if key not in helps:
            done = macromicro(*key.split(), "--help")
            assert done.status == 0, key
            helps[key] = done.out
        for word in words:
            assert not word.startswith("--") or word in helps[key], " ".join(words)


@posix
@pytest.mark.parametrize("after", [1.0, pytest.param(1.6, marks=pytest.mark.slow)])
def test_interrupted_while_collecting_leaves_nothing(after: float, tmp_path: Path) -> None:
    """A signal may fall into the compiler's work: no crash, no traceback, no folder."""
    process = subprocess.Popen(
        [sys.executable, "-m", "macromicro", "collect", "electrothermal", "--out", "o"],
        cwd=tmp_path,
        env={**os.environ, "MACROMICRO_CACHE": str(tmp_path / "cache")},
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    first = process.stderr.readline()
    assert "collecting" in first
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in errors and "Traceback" not in errors
    assert [path.name for path in tmp_path.iterdir()] in ([], ["cache"])
