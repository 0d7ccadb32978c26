"""Recordings: what is appended is on disk, whatever happens to the process or the disk."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.recording import Recorder, Recording, RecordingError, check_space, needed_bytes
from tests.systems import linux, posix

COLUMNS = (
    Column("t", "s", "time"),
    Column("hall_voltage", "V", "Hall sensor"),
    Column("phase", "-", "state of the supervisor", "i1"),
    Column("move", "-", "index of the move", "i4"),
)
ATTRIBUTES: dict[str, str | int | float] = {"seed": 7, "version": "0.1", "ambient_degC": 22.5}

# Row i holds i, i/8, i mod 100, -i: every row says which one it is.
WRITER = """
import itertools, os, sys
import numpy as np
from macromicro.columns import Column
from macromicro.recording import Recorder
columns = [Column("t", "s", ""), Column("x", "V", ""),
           Column("phase", "-", "", "i1"), Column("move", "-", "", "i4")]
def block(first, rows):
    i = np.arange(first, first + rows, dtype=float)
    return np.array([i, i / 8, i % 100, -i])
"""


def rows_of(first: int, rows: int) -> np.ndarray:
    i = np.arange(first, first + rows, dtype=float)
    return np.array([i, i / 8, i % 100, -i])


def assert_rows(recording: Recording, least: int) -> None:
    """`recording` holds rows 0, 1, 2 ... and at least as many as `least`."""
    assert recording.rows >= least
    expected = rows_of(0, recording.rows)
    for column, values in zip(recording.columns, expected, strict=True):
        np.testing.assert_array_equal(recording[column.name], values)


def python(script: str, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", WRITER + script, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "recording.h5"


def recorder(path: Path, capacity: int = 100, **options: bool) -> Recorder:
    return Recorder(path, COLUMNS, capacity, 1e-3, ATTRIBUTES, **options)


# --- round trip -----------------------------------------------------------------------

DTYPES = ("f8", "f4", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8")
text = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20)
names = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,15}", fullmatch=True).filter(
    lambda name: name not in ("rows", "t")
)
values = text | st.integers(-(2**63), 2**63 - 1) | st.floats()
keys = text.filter(
    lambda key: key.isprintable() and key and key not in ("format", "sample_time_s", "columns")
)


@st.composite
def tables(draw: st.DrawFn) -> tuple[list[Column], list[np.ndarray]]:
    found = draw(st.lists(names, max_size=4, unique=True))
    found.insert(draw(st.integers(0, len(found))), "t")
    columns = [Column(n, draw(text), draw(text), draw(st.sampled_from(DTYPES))) for n in found]
    rows = draw(st.integers(0, 40))
    return columns, [draw(hnp.arrays(c.dtype, rows)) for c in columns]


@settings(max_examples=30, deadline=None)
@given(
    table=tables(),
    dt=st.floats(1e-9, 1e9),
    attributes=st.dictionaries(keys, values, max_size=4),
)
def test_save_and_load_give_the_same_back(tmp_path_factory, table, dt, attributes):
    columns, arrays = table
    place = tmp_path_factory.mktemp("trip") / "recording.h5"
    Recording.from_arrays(columns, arrays, dt, attributes).save(place)
    loaded = Recording.load(place)
    assert loaded.columns == tuple(columns)
    assert loaded.dt == dt
    assert len(loaded) == loaded.rows == len(arrays[0])
    assert {k: repr(v) for k, v in loaded.attributes.items()} == {
        k: repr(v) for k, v in attributes.items()
    }
    for column, array in zip(columns, arrays, strict=True):
        assert loaded[column.name].dtype == np.dtype(column.dtype)
        np.testing.assert_array_equal(loaded[column.name], array)
        assert loaded.unit(column.name) == column.unit


@settings(max_examples=20, deadline=None)
@given(
    blocks=st.lists(st.integers(0, 60), max_size=8),
    capacity=st.integers(1, 150),
    fortran=st.booleans(),
)
def test_any_blocks_in_any_capacity_make_one_recording(tmp_path_factory, blocks, capacity, fortran):
    """Growing, trimming and the layout of a block in memory leave the rows as they are."""
    place = tmp_path_factory.mktemp("blocks") / "recording.h5"
    with recorder(place, capacity) as writer:
        for rows in blocks:
            block = rows_of(writer.rows, rows)
            writer.append(np.asfortranarray(block) if fortran else block)
            now = Recording.load(place)  # a run can be read while it goes on
            assert now.rows == writer.rows
            assert_rows(now, writer.rows)
    loaded = Recording.load(place)
    assert loaded.rows == sum(blocks)
    assert_rows(loaded, sum(blocks))
    assert os.listdir(place.parent) == ["recording.h5"]
    with h5py.File(place) as file:
        assert file["t"].shape == (sum(blocks),)


# --- other readers --------------------------------------------------------------------


def test_plain_h5py_finds_numbers_units_and_provenance(path):
    with recorder(path) as writer:
        writer.append(rows_of(0, 40))
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["hall_voltage"][:], np.arange(40) / 8)
        assert file["hall_voltage"].attrs["units"] == "V"
        assert file["hall_voltage"].attrs["long_name"] == "Hall sensor"
        assert file["phase"].dtype == np.int8
        assert file["move"].dtype == np.int32
        assert file["rows"][()] == 40
        assert file["hall_voltage"].dims[0][0] == file["t"]
        assert file["t"].is_scale
        assert file.attrs["format"] == "macromicro recording 1"
        assert file.attrs["sample_time_s"] == 1e-3
        assert file.attrs["seed"] == 7
        for name in ("t", "hall_voltage", "phase", "move"):
            assert file[name].compression is None  # nothing that MATLAB lacks


def test_xarray_opens_the_file_with_time_as_coordinate(path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with recorder(path) as writer:
        writer.append(rows_of(0, 40))
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert data.sizes == {"t": 40}
        assert "t" in data.coords
        assert float(data["hall_voltage"].sel(t=16.0)) == 2.0
        assert data["hall_voltage"].attrs["units"] == "V"
        assert data.attrs["version"] == "0.1"


def test_to_xarray_says_the_same(path):
    pytest.importorskip("xarray")
    data = Recording.from_arrays(COLUMNS, rows_of(0, 40), 1e-3, ATTRIBUTES).to_xarray()
    assert set(data.coords) == {"t"}
    assert set(data.data_vars) == {"hall_voltage", "phase", "move"}
    assert float(data["hall_voltage"].sel(t=16.0)) == 2.0
    assert data["phase"].dtype == np.int8
    assert data["hall_voltage"].attrs == {"units": "V", "long_name": "Hall sensor"}
    assert data.attrs["seed"] == 7
    assert data.attrs["sample_time_s"] == 1e-3


# --- casts ----------------------------------------------------------------------------


def one_column(dtype: str, values: list[float]) -> np.ndarray:
    columns = (Column("t", "s", ""), Column("x", "-", "", dtype))
    return Recording.from_arrays(columns, np.array([values, values]), 1.0, {})["x"]


def test_integer_columns_take_the_nearest_whole_number():
    assert one_column("i4", [0.4, 0.6, -0.6, 1.5, 2.5]).tolist() == [0, 1, -1, 2, 2]
    assert one_column("i4", [2**31 - 1.0, -(2.0**31)]).tolist() == [2**31 - 1, -(2**31)]


@pytest.mark.parametrize(
    ("dtype", "value"),
    [
        ("i1", np.nan),
        ("i1", np.inf),
        ("i1", 127.5),
        ("i1", -129.0),
        ("i4", 2.0**31),
        ("i8", 2.0**63),
        ("u1", -1.0),
        ("f4", 1e300),
    ],
)
def test_what_a_column_cannot_hold_is_refused_and_named(dtype, value):
    with pytest.raises(InputError, match=r"'x', row 2"):
        one_column(dtype, [0.0, 0.0, value])


def test_a_refused_block_leaves_no_trace(path):
    bad = rows_of(20, 10)
    bad[2, 3] = np.nan
    with recorder(path) as writer:
        writer.append(rows_of(0, 20))
        with pytest.raises(InputError, match=r"'phase', row 3"):
            writer.append(bad)
        with pytest.raises(InputError, match="for 4 columns"):
            writer.append(rows_of(20, 10)[:3])
        with pytest.raises(InputError, match="as many in each"):
            writer.append([np.zeros(5), np.zeros(5), np.zeros(5), np.zeros(4)])
        writer.append(rows_of(20, 10))
    assert_rows(Recording.load(path), 30)


# --- killed processes -----------------------------------------------------------------


@posix
def test_killed_at_random_instants_nothing_confirmed_is_lost(tmp_path):
    """SIGKILL while files are made, written, grown and closed."""
    script = """
folder = sys.argv[1]
sizes = np.random.default_rng(int(sys.argv[2]))
for number in itertools.count():
    path = os.path.join(folder, f"{number}.h5")
    with Recorder(path, columns, int(sizes.integers(200, 3000)), 1e-3, {"seed": 1}) as writer:
        print(number, 0, flush=True)
        for rows in sizes.integers(1, 700, 12):
            writer.append(block(writer.rows, int(rows)))
            print(number, writer.rows, flush=True)
"""
    chance = random.Random(5)
    kills = 6
    checked = 0
    for kill in range(kills):
        folder = tmp_path / str(kill)
        folder.mkdir()
        writer = python(script, str(folder), str(kill))
        assert writer.stdout is not None
        first = writer.stdout.readline()
        time.sleep(chance.uniform(0.0, 0.15))
        writer.send_signal(signal.SIGKILL)
        said = writer.stdout.read()  # behind what readline has taken ahead: communicate is not
        assert writer.wait() == -signal.SIGKILL
        confirmed: dict[int, int] = {}
        for line in (first + said).splitlines(keepends=True):
            if line.endswith("\n"):
                number, rows = map(int, line.split())
                confirmed[number] = rows
        for number, rows in confirmed.items():
            place = folder / f"{number}.h5"
            assert_rows(Recording.load(place), rows)
            with h5py.File(place) as file:
                np.testing.assert_array_equal(file["t"][:rows], np.arange(rows))
            checked += 1
    assert checked >= kills


@posix
def test_a_killed_file_is_whole_in_h5py_and_trimmed_by_load(path):
    script = """
writer = Recorder(sys.argv[1], columns, 500, 1e-3, {"seed": 1})
writer.append(block(0, 123))
os.kill(os.getpid(), 9)
"""
    writer = python(script, str(path))
    writer.communicate()
    assert writer.returncode == -signal.SIGKILL
    with h5py.File(path) as file:
        assert file["t"].shape == (500,)
        assert file["rows"][()] == 123
    loaded = Recording.load(path)
    assert loaded.rows == 123
    assert_rows(loaded, 123)
    copy = path.with_name("copy.h5")
    loaded.save(copy)
    with h5py.File(copy) as file:
        assert file["t"].shape == (123,)


# --- full disks -----------------------------------------------------------------------

LIMITED = """
import resource
from macromicro.recording import RecordingError
def limit(size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
"""


def answers(script: str, *arguments: str) -> list[str]:
    process = python(LIMITED + script, *arguments)
    said, complaints = process.communicate()
    assert process.returncode == 0, complaints
    assert complaints == ""
    return said.splitlines()


@posix
def test_disk_full_midway_keeps_the_earlier_rows(path):
    """The last columns of the file lie beyond the limit; the process ends in good order."""
    script = """
with Recorder(sys.argv[1], columns, 20000, 1e-3, {}) as writer:
    writer.append(block(0, 4000))
    limit(os.path.getsize(sys.argv[1]) - 50_000)
    for _ in range(2):
        try:
            writer.append(block(4000, 6000))
        except RecordingError as error:
            print(error)
    print(writer.rows)
"""
    first, second, rows = answers(script, str(path))
    assert "4000 rows are safe" in first
    assert str(path) in first
    assert "File too large" in first
    assert first == second
    assert rows == "4000"
    loaded = Recording.load(path)
    assert loaded.rows == 4000
    assert_rows(loaded, 4000)
    assert os.listdir(path.parent) == [path.name]


@posix
def test_disk_full_while_growing_keeps_the_file(path):
    script = """
with Recorder(sys.argv[1], columns, 1000, 1e-3, {}) as writer:
    writer.append(block(0, 900))
    limit(os.path.getsize(sys.argv[1]))
    try:
        writer.append(block(900, 200))
    except RecordingError as error:
        print(error)
    limit(resource.RLIM_INFINITY)
    writer.append(block(900, 200))
    print(writer.rows)
"""
    first, rows = answers(script, str(path))
    assert "900 rows are safe" in first
    assert rows == "1100"
    assert_rows(Recording.load(path), 1100)


@linux
def test_disk_full_from_the_start_is_an_error_without_a_file(path):
    """HDF5 itself crashes the process when it closes a file that it could not write."""
    script = """
for limited in (0, 100, 3000, 10_000, 100_000):
    for reserving in (True, False):
        if not reserving:
            os.posix_fallocate = lambda fd, offset, size: None
        limit(limited)
        try:
            Recorder(sys.argv[1], columns, 20000, 1e-3, {})
        except RecordingError as error:
            limit(resource.RLIM_INFINITY)
            print(error)
"""
    said = answers(script, str(path))
    assert len(said) == 10
    assert all(line.endswith("cannot be made: File too large") for line in said)
    assert os.listdir(path.parent) == []


@posix
def test_too_little_space_is_said_before_the_run(path):
    free = os.statvfs(path.parent).f_bavail * os.statvfs(path.parent).f_frsize
    check_space(path.parent, 1000)
    check_space(path.parent / "later" / "on", 1000)
    with pytest.raises(InputError, match=r"MB free.*at least \d+\.\d MB free") as caught:
        check_space(path.parent, 2 * free)
    assert str(path.parent) in str(caught.value)
    rows = 2 * free // (8 + 8 + 1 + 4)
    assert needed_bytes(COLUMNS, rows) >= rows * (8 + 8 + 1 + 4)
    with pytest.raises(InputError, match="MB free"):
        recorder(path, rows)
    assert not path.exists()


def test_a_file_takes_no_more_than_was_said(path):
    with recorder(path, 5000):
        assert path.stat().st_size <= needed_bytes(COLUMNS, 5000)


def test_an_unwritable_folder_is_refused(path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="not writable"):
        check_space(path.parent, 1)
    (path.parent / "plain").write_text("")
    with pytest.raises(InputError, match="not a folder"):
        check_space(path.parent / "plain", 1)


# --- refusals -------------------------------------------------------------------------


def test_an_existing_file_is_kept_unless_told_otherwise(path):
    with recorder(path) as writer:
        writer.append(rows_of(0, 9))
    with pytest.raises(InputError, match="already exists"):
        recorder(path)
    assert_rows(Recording.load(path), 9)
    with recorder(path, overwrite=True) as writer:
        writer.append(rows_of(0, 3))
    assert Recording.load(path).rows == 3
    with pytest.raises(InputError, match="already exists"):
        recorder(path.parent, overwrite=True)
    with pytest.raises(InputError, match="folder does not exist"):
        recorder(path.parent / "none" / "recording.h5")


def test_load_says_what_it_accepts(path):
    text_file, foreign = path.with_name("a.h5"), path.with_name("b.h5")
    text_file.write_text("t,x\n0,1\n")
    with h5py.File(foreign, "w") as file:
        file["t"] = [1.0, 2.0]
    for wrong, why in (
        (path, "no such file"),
        (path.parent, "a folder"),
        (text_file, "not a recording"),
        (foreign, "not a recording"),
        (Path(os.devnull), "not a file"),
    ):
        with pytest.raises(InputError, match=f"{why}.*Use a recording") as caught:
            Recording.load(wrong)
        assert str(wrong) in str(caught.value)


@pytest.mark.parametrize("name", ["rows", "t", "move"])
def test_a_damaged_recording_is_refused(path, name):
    with recorder(path) as writer:
        writer.append(rows_of(0, 9))
    with h5py.File(path, "r+") as file:
        del file[name]
    with pytest.raises(InputError, match="damaged"):
        Recording.load(path)


def test_a_cut_off_file_is_refused(path):
    with recorder(path) as writer:
        writer.append(rows_of(0, 100))
    os.truncate(path, path.stat().st_size - 100)
    with pytest.raises(InputError, match="cannot be opened"):
        Recording.load(path)


def test_an_unknown_column_names_the_known_ones(path):
    recording = Recording.from_arrays(COLUMNS, rows_of(0, 4), 1e-3, {})
    for ask in (recording.__getitem__, recording.unit):
        with pytest.raises(InputError, match=r"'laser'.*t, hall_voltage, phase, move"):
            ask("laser")
    assert "phase" in recording
    assert "laser" not in recording


@pytest.mark.parametrize(
    "columns",
    [
        [],
        [Column("x", "V", "no time")],
        [Column("t", "s", ""), Column("t", "s", "")],
        [Column("t", "s", ""), Column("rows", "-", "")],
        [Column("t", "s", ""), Column("hall voltage", "V", "")],
        [Column("t", "s", ""), Column("x", "V", "", "U5")],
        [Column("t", "s", ""), Column("x", "V", "", "c16")],
        [Column("t", "s", ""), Column("x", "V", "", "number")],
        [Column("t", "s", ""), Column("x", "V\0", "")],
    ],
)
def test_impossible_columns_are_refused(path, columns):
    with pytest.raises(InputError):
        Recorder(path, columns, 10, 1e-3, {})
    assert not path.exists()


@pytest.mark.parametrize(
    "attributes",
    [
        {"format": "mine"},
        {"": 1},
        {"big": 2**63},
        {"nul": "a\0b"},
        {"half": "\ud800"},
        {"list": [1, 2]},
    ],
)
def test_impossible_attributes_are_refused(path, attributes):
    with pytest.raises(InputError):
        Recorder(path, COLUMNS, 10, 1e-3, attributes)
    assert not path.exists()


@pytest.mark.parametrize(("capacity", "dt"), [(0, 1e-3), (10, 0.0), (10, np.nan)])
def test_impossible_sizes_and_times_are_refused(path, capacity, dt):
    with pytest.raises(InputError):
        Recorder(path, COLUMNS, capacity, dt, {})
    assert not path.exists()


def test_a_closed_recorder_says_so(path):
    with recorder(path) as writer:
        writer.append(rows_of(0, 9))
        writer.flush()
    writer.close()
    assert writer.rows == 9
    with pytest.raises(RecordingError, match="closed"):
        writer.append(rows_of(9, 9))


def test_long_provenance_survives(path):
    """A whole parameter file fits into one attribute."""
    long = "mass = 1.0\n" * 20_000
    Recording.from_arrays(COLUMNS, rows_of(0, 4), 1e-3, {"config": long}).save(path)
    assert Recording.load(path).attributes == {"config": long}


def test_columns_are_read_late_and_the_file_is_free_meanwhile(path, monkeypatch):
    with recorder(path) as writer:
        writer.append(rows_of(0, 9))
    monkeypatch.chdir(path.parent)
    loaded = Recording.load(path.name)
    monkeypatch.chdir("/")
    with h5py.File(path, "r+") as file:  # no one holds a lock
        file["hall_voltage"][:] = 5.0
    assert loaded["hall_voltage"].tolist() == [5.0] * 9
    path.unlink()
    assert loaded["hall_voltage"].tolist() == [5.0] * 9
    with pytest.raises(InputError, match="no such file"):
        loaded["move"]
