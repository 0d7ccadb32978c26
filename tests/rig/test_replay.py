"""A recording played back: the same sensors, period by period, and nothing that moves."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import macromicro
from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.rig.replay import Replay, open_recording
from macromicro.runs import job
from macromicro.types import SAFE

PROGRAMME = """
[[moves]]
macro = ["20 mm"]
micro = ["0.5 mm"]
hold = "1 s"
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a programme and its run."""
    folder = tmp_path_factory.mktemp("replay")
    (folder / "short.toml").write_text(PROGRAMME)
    macromicro.run(folder / "short.toml", seed=3).save(folder / "made.h5")
    return folder


def test_sensors_are_those_of_the_file() -> None:
    columns = [Column(name, "-", name) for name in ("t", "hall_voltage", "laser", "extend")]
    rows = np.array([[5.0, 5.001, 5.002], [2.0, 2.1, math.nan], [1.0, 2.0, 3.0], [-1, -1, -1]])
    with Replay(Recording.from_arrays(columns, rows, 1e-3, {})) as rig:
        assert rig.channels == ("hall", "laser") and rig.rows == 3
        first = rig.read()
        rig.write(SAFE._replace(motor=3.0))
        rig.wait(1e-3)
        second = rig.read()
        for _ in range(3):
            rig.wait(1e-3)
        assert (first.t, first.hall, first.laser) == (0.0, 2.0, 1e-6)
        assert (second.t, second.hall) == (pytest.approx(1e-3), 2.1)
        assert math.isnan(second.encoder) and math.isnan(second.extend)
        assert rig.read().laser == pytest.approx(3e-6) and math.isnan(rig.read().hall)
    with rig:
        assert rig.read().hall == 2.0


def test_it_begins_at_the_first_row_and_0_is_a_signal() -> None:
    columns = [Column(name, "-", name) for name in ("t", "macro_position", "extend", "contract")]
    rows = [[0.0, 1e-3], [7.0, 8.0], [0, 1], [1, -1]]
    rig = Replay(Recording.from_arrays(columns, rows, 1e-3, {}))
    assert rig.channels == ("encoder", "extend", "contract") and rig.rows == 2
    assert rig.read()[:2] == (0.0, 7.0) and rig.read()[4:] == (0.0, 1.0)
    rig.wait(1e-3)
    assert rig.read().extend == 1.0 and math.isnan(rig.read().contract)


def replayed(folder: Path, out: str, rig: str = "", **rest: object) -> job.Ended:
    request = job.Request(str(folder / "short.toml"), folder / out, **rest)  # type: ignore[arg-type]
    request = request._replace(rig=rig or f"replay:{folder / 'made.h5'}")
    return job.execute(job.check(request))


def test_the_same_controller_asks_for_the_same(made: Path) -> None:
    """Bit for bit, with the moves of the run; recorded outputs stand beside."""
    run = Recording.load(made / "made.h5")
    ended = replayed(made, "same")
    found = ended.recording
    assert ended.finished and ended.fault is None and len(found) == len(run)
    for name in ("motor", "ctrl", "fan"):
        assert np.array_equal(found[name], run[name])
        assert np.array_equal(found[f"recorded_{name}"], run[name])
    for name in ("macro_position", "hall_voltage", "t"):
        assert np.array_equal(found[name], run[name])
    assert found.attributes["rig"] == f"replay:{made / 'made.h5'}"
    pairs = zip(macromicro.moves(found), macromicro.moves(run), strict=True)
    for one, other in pairs:
        assert one.settling_s == other.settling_s and one.target == other.target


def test_another_controller_asks_for_something_else(made: Path) -> None:
    (made / "pd.toml").write_text('[controller]\nmacro_law = "pd-initial"\n')
    ended = replayed(made, "other", config=made / "pd.toml")
    found = ended.recording
    assert not np.array_equal(found["motor"], found["recorded_motor"])
    assert np.isnan(found["true_carriage"]).all()


def test_the_end_of_the_file_ends_the_run(made: Path) -> None:
    run = Recording.load(made / "made.h5")
    arrays = [run[c.name][:500] for c in run.columns]
    Recording.from_arrays(run.columns, arrays, run.dt, {}).save(made / "cut.h5")
    ended = replayed(made, "cut", f"replay:{made / 'cut.h5'}")
    assert len(ended.recording) == 500 and not ended.finished and ended.fault is None


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("replay:", "replay:FILE"),
        ("mylab:bench", "replay:FILE"),
        ("replay:no such.h5", "no such file"),
        ("replay:pyproject.toml", "not a recording"),
    ],
)
def test_what_is_no_recording_is_bad_input(name: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        open_recording(name)


def test_a_recording_without_sensors_is_bad_input() -> None:
    recording = Recording.from_arrays([Column("t", "s", "time")], [[0.0]], 1e-3, {})
    with pytest.raises(InputError, match="no sensors"):
        Replay(recording)
    empty = Recording.from_arrays([Column(n, "s", n) for n in ("t", "laser")], [[], []], 1e-3, {})
    with pytest.raises(InputError, match=r"replay:mine\.h5: the recording has no sensors"):
        Replay(empty, "mine.h5")
    hall = Column("hall_voltage", "V", "hall")
    empty = Recording.from_arrays([Column("t", "s", "t"), hall], [[], []], 1e-3, {})
    with pytest.raises(InputError, match="no sensors"):
        Replay(empty)
