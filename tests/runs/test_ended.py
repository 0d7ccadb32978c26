"""What a run's file says of its end, and what is in it where there was none."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest
from tests.command import BARE
from tests.command import command as macromicro
from tests.systems import posix

from macromicro import cli
from macromicro.recorded import COLUMNS
from macromicro.recorder import Behind, Recorder, RecordingError
from macromicro.recording import Recording

ONE = '[[moves]]\nmacro = "100 mm"\nhold = "1 s"\n'
TWO = '[[moves]]\nx = "50 mm"\ny = "40 mm"\nhold = "1 s"\n'
TIGHT = 'guard.error = "1 um"\n'
FAMILIES = {
    "two_stage": ("", 'guard.stuck = "1 ms"\n', ONE, "{0}:bench"),
    "axis": ('machine = "axis"\n', TIGHT, ONE, "{0}:axis"),
    "xy": ('machine = "xy"\n', f"y.{TIGHT}", TWO, "{0}:x+{0}:y"),
}
RIGS = """
import os, signal, time
from pathlib import Path
from macromicro.machines import compositions, rig
from macromicro.plant import bench as plant
from macromicro.recording import Recording
from macromicro.rig.twin import Twin
from macromicro.settings import Settings

HERE = Path(__file__).parent

def dying(made):
    "It kills its process in the middle of the run, once there are rows in the file."
    read, n = made.read, [0]
    def counted():
        n[0] += 1
        if n[0] == 400:
            end = time.monotonic() + 60.0
            while not len(Recording.load(HERE / "out/recording.h5")) and time.monotonic() < end:
                time.sleep(0.01)
            os.kill(os.getpid(), signal.SIGKILL)
        return read()
    made.read = counted
    return made

def bench(seed):
    return dying(Twin(plant.prepare(Settings().bench, Settings().sensors), seed))

def one(seed, k=0):
    _, own, tree = compositions.each(HERE / "m.toml")[k]
    return rig.CompiledTwin(own.kind, tree, seed)

def axis(seed):
    return dying(one(seed))

x = axis

def y(seed):
    return one(seed, 1)
"""


@pytest.fixture(params=FAMILIES)
def family(request, tmp_path, monkeypatch):
    """A folder with a programme, and what a family's files and rig are."""
    monkeypatch.chdir(tmp_path)
    good, tight, programme, rig = FAMILIES[request.param]
    (tmp_path / "p.toml").write_text(programme)
    (tmp_path / "m.toml").write_text(good or "controller.motor_limit = '5 V'\n")
    (tmp_path / "tight.toml").write_text(good + tight)
    return rig


def ran(monkeypatch, config):
    words = [
        *BARE,
        "p.toml",
        "--config",
        config,
        "--out",
        "out",
        "--overwrite",
    ]
    monkeypatch.setattr("sys.argv", ["macromicro", *words])
    return cli.main(), Recording.load("out/recording.h5").attributes


def test_a_file_says_whether_its_run_finished_and_which_fault_ended_it(family, monkeypatch):
    status, said = ran(monkeypatch, "m.toml")
    assert status == 0 and said["finished"] == 1 and "fault" not in said
    status, said = ran(monkeypatch, "tight.toml")
    assert status == 1 and said["finished"] == 0
    assert said["fault"].startswith(("The ", "Axis y: The ")) and said["fault"].count(".") > 1


@posix
def test_rows_survive_a_process_that_is_killed_while_it_runs_on_a_rig(family, tmp_path):
    (tmp_path / "mortal.py").write_text(RIGS)
    words = [*BARE, "p.toml", "--config", "m.toml", "--out", "out", "--yes"]
    rig = ["--rig", family.format("mortal")]
    done = macromicro(*words, *rig, cwd=tmp_path)
    assert done.returncode == -signal.SIGKILL, done.stderr
    left = Recording.load(tmp_path / "out/recording.h5")
    assert left.attributes["finished"] == 0 and 0 < len(left) <= 400
    assert np.diff(left["t"]) == pytest.approx(left.dt)
    named = next(n for n in ("macro_position", "position", "x_position") if n in left)
    assert np.isfinite(left[named]).all() and np.ptp(left[named]) > 0.0


class Full:
    """A disk that takes no more."""

    def append(self, block):
        raise RecordingError("no space")


def test_what_is_handed_on_behind_a_loop_is_all_there_in_order(tmp_path: Path):
    rows = np.arange(3.0 * 7000).reshape(7000, 3).T
    columns = tuple(c._replace(dtype="f8") for c in COLUMNS if c.name in ("t", "motor", "ctrl"))
    with Recorder(tmp_path / "r.h5", columns, 100, 1e-3, {}) as recorder, Behind(recorder) as sink:
        for k in range(0, 7000, 7):
            sink.append(rows[:, k : k + 7])
    found = Recording.load(tmp_path / "r.h5")
    assert np.array_equal([found[c.name] for c in columns], rows)


def test_an_error_of_the_file_reaches_the_loop():
    with pytest.raises(RecordingError, match="no space"), Behind(Full()) as sink:
        sink.append(np.zeros((1, 1)))
    with pytest.raises(RecordingError, match="no space"), Behind(Full()) as sink:
        while True:
            sink.append(np.zeros((1, 1)))
