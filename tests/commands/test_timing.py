"""macromicro doctor --seconds: the loop on the twin, measured by its own telemetry."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from macromicro.commands._timing import _as_json, _edges, table
from macromicro.control.live import messages as m
from macromicro.serve import measuring
from macromicro.serve.faults import LATE, describe
from macromicro.serve.measuring import Latency
from macromicro.serve.settings import LiveSettings, load
from tests.command import command
from tests.systems import linux, posix
from tests.warm import Command

RUN = (sys.executable, "-m", "macromicro", "doctor", "--seconds")
GOT = Latency(
    np.linspace(1e-6, 100e-6, 100), np.full(100, 80e-6), 101, 1, 0.05, 7e-4, "as it is", None
)


def config(folder: Path) -> str:
    path = folder / "live.toml"
    path.write_text("[serve]\nmiss_share = 1.0\n")
    return str(path)


def test_the_numbers_are_of_every_period(tmp_path: Path) -> None:
    picture, options = tmp_path / "latency.png", ("--seconds", "1.5", "--json")
    told = ("--figure", picture, "--config", config(tmp_path))
    done = command("doctor", *options, *told, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    computed = found["periods"] - found["missed"]
    for name in ("late", "work"):
        assert computed - 100 < sum(found[name]["histogram"]["counts"]) <= computed
        assert 0.0 < found[name]["p50_s"] <= found[name]["p99_s"] <= found[name]["greatest_s"]
    assert found["emergency_stop_s"] > 0.0
    assert picture.read_bytes().startswith(b"\x89PNG")


@posix
def test_ctrl_c_gives_what_was_measured_until_then(tmp_path: Path) -> None:
    process = Command(
        [*RUN, "600", "--config", config(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    line = process.stderr.readline()
    while "timing: 600 s" not in line and line:
        line = process.stderr.readline()
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in error
    assert "late at wake-up" in out


def test_files_that_cannot_be_made_are_refused_before_anything_runs(tmp_path: Path) -> None:
    picture = tmp_path / "none" / "x.png"
    done = command("doctor", "--seconds", "1", "--figure", picture, cwd=tmp_path)
    assert done.returncode == 2
    assert not (tmp_path / "none").exists()


@linux
@pytest.mark.parametrize(
    ("option", "file", "found"),
    [
        ("--figure", "x.xyz", "suffix is .xyz"),
        ("--figure", "-", "no suffix"),
        ("--figure", "x", "no suffix"),
        ("--figure", "/proc/x.png", "No such file"),
    ],
)
def test_results_that_could_not_be_written_are_refused_before_measuring(
    option: str, file: str, found: str, tmp_path: Path
) -> None:
    done = command("doctor", "--seconds", "1", option, file, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"macromicro: {option} {file}: ") and found in done.stderr
    assert not list(tmp_path.iterdir())


def test_the_table_and_the_json_say_the_same() -> None:
    lines = list(table(GOT, LiveSettings()))
    assert lines[1].split()[-1] == "100"
    assert "missed periods: 1 of 101; at most 5.00% in 1 s, allowed 10%" in lines
    found = _as_json(GOT._replace(emergency=math.nan), LiveSettings())
    assert found["late"]["greatest_s"] == pytest.approx(100e-6)
    assert found["emergency_stop_s"] is None
    assert sum(found["work"]["histogram"]["counts"]) == 100
    json.dumps(found, allow_nan=False)


def test_a_run_without_a_single_period() -> None:
    empty = np.empty(0)
    none = GOT._replace(late=empty, work=empty, fault=describe(LATE, 0.5, 0.1, 0.0))
    assert "nan" in list(table(none, LiveSettings()))[1]
    found = _as_json(none, LiveSettings())
    assert found["late"]["p50_s"] is None
    assert "missed" in found["fault"]


@pytest.mark.parametrize("most", [2e-7, 1e-6, 5e-4, 1e-3, 3.0])
def test_every_value_is_in_a_bin(most: float) -> None:
    values = np.array([0.0, 1e-7, most])
    assert np.histogram(values, bins=_edges(values))[0].sum() == 3


def test_a_machine_of_a_file_is_moved_within_its_travel() -> None:
    examples = Path(__file__).parents[2] / "examples" / "machines"
    screw = load(examples / "screw.toml")
    places = [move.position for move in measuring.moves(screw)]
    assert len(set(places)) == 4 and min(places) > 0.0 and max(places) < 0.04
    points = measuring.moves(load(examples / "xy-plotter.toml"))
    assert {type(point) for point in points} == {m.MovePoint}
    assert max(p.to["x"] for p in points) > max(p.to["y"] for p in points) > 0.02
    assert all(0.0 < p.to["x"] < 0.2 and 0.0 < p.to["y"] < 0.07 for p in points)
    assert measuring.moves(LiveSettings())[0] == m.MoveTo(20.4e-3)


@pytest.mark.slow
def test_two_axes_are_measured_at_work(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    text = (Path(__file__).parents[2] / "examples" / "machines" / "xy-plotter.toml").read_text()
    file.write_text(text + "\n[serve]\nmiss_share = 1.0\n")
    settings = load(file)
    got = measuring.measure(settings, 6.0, lambda done: True)
    assert got.fault is None and len(got.work) > 4000
