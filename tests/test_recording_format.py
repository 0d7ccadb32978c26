"""Layout of a recording's file: columns, attributes, numbers that fit, failures of the disk."""

from __future__ import annotations

import errno
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro import recording_format as form
from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.recording_format import (
    Layout,
    Noted,
    as_block,
    as_column,
    needed_bytes,
    parse_notes,
    write_all,
)
from tests.systems import linux, posix

COLUMNS = (Column("t", "s", "time"), Column("x", "m", "place", "f4"), Column("n", "1", "", "i2"))
PLAIN = Layout.checked(COLUMNS, 0.5, {"seed": 3}, "here")


def opened(path: Path) -> int:
    return os.open(path, os.O_RDWR | os.O_CREAT)


@pytest.mark.parametrize("events", [None, 100])
def test_a_file_is_laid_out_with_the_places_that_are_told(
    tmp_path: Path, events: int | None
) -> None:
    """What is written at the places is what HDF5 reads there."""
    import h5py

    path = tmp_path / "a.h5"
    fd = opened(path)
    places = PLAIN.write(fd, 4, events)
    write_all(fd, np.int64(3).tobytes(), places.rows)
    for k, (place, kind) in enumerate(zip(places.columns, ("f8", "f4", "i2"), strict=True)):
        write_all(fd, np.arange(4 * k, 4 * k + 4).astype(kind).tobytes(), place)
    if events is None:
        assert (places.event_bytes, places.events) == (-1, -1)
    else:
        write_all(fd, np.int64(5).tobytes(), places.event_bytes)
        write_all(fd, b"hello", places.events)
    os.close(fd)
    with h5py.File(path, "r") as file:
        assert file["rows"][()] == 3
        assert [file[c.name][:].tolist() for c in COLUMNS] == [
            [0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0], [8, 9, 10, 11]
        ]  # fmt: skip
        assert dict(file.attrs) == {
            "format": "macromicro recording 1", "sample_time_s": 0.5, "columns": "t x n", "seed": 3
        }  # fmt: skip
        assert file["x"].attrs["units"] == "m" and file["x"].attrs["long_name"] == "place"
        assert file["x"].dims[0][0] == file["t"] and len(file["t"].dims[0]) == 0
        assert file["x"].dtype == np.float32 and file["n"].dtype == np.int16
        assert file["x"].chunks is None
        if events is None:
            assert "events" not in file
        else:
            assert file["event_bytes"][()] == 5
            assert bytes(file["events"][:5]) == b"hello" and file["events"].shape == (100,)


def test_two_files_of_one_layout_are_the_same_bytes(tmp_path: Path) -> None:
    made = []
    for name in ("a.h5", "b.h5"):
        fd = opened(tmp_path / name)
        PLAIN.write(fd, 4, 10)
        os.close(fd)
        made.append((tmp_path / name).read_bytes())
    assert made[0] == made[1]
    assert len(made[0]) < needed_bytes(COLUMNS, 4, 10)


def test_a_new_file_has_no_rows_and_no_events_and_says_what_they_are(tmp_path: Path) -> None:
    import h5py

    fd = opened(tmp_path / "a.h5")
    PLAIN.write(fd, 4, 100)
    os.close(fd)
    with h5py.File(tmp_path / "a.h5", "r") as file:
        assert file["rows"][()] == 0 == file["event_bytes"][()]
        for name, word in (("rows", "recorded"), ("event_bytes", "bytes"), ("events", "JSON")):
            assert word in file[name].attrs["long_name"]


def test_no_rows_need_no_place(tmp_path: Path) -> None:
    fd = opened(tmp_path / "a.h5")
    assert PLAIN.write(fd, 0, 0)[1:] == ((0, 0, 0), pytest.approx(1e4, abs=1e4), 0)
    os.close(fd)


@pytest.mark.parametrize("failing", [1, 2, 3])
def test_a_write_that_fails_is_raised_once_the_file_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: int
) -> None:
    """The first failure, though HDF5 is told that all went well, and goes on."""
    calls: list[int] = []
    real = form.write_all

    def full(fd: int, data: Any, offset: int) -> None:
        calls.append(offset)
        if len(calls) >= failing:
            raise OSError(errno.ENOSPC, f"call {len(calls)}")
        real(fd, data, offset)

    monkeypatch.setattr(form, "write_all", full)
    fd = opened(tmp_path / "a.h5")
    with pytest.raises(OSError, match=f"call {failing}$") as caught:
        PLAIN.write(fd, 4)
    assert caught.value.errno == errno.ENOSPC and len(calls) > failing
    os.close(fd)


@linux
@pytest.mark.parametrize("number", [errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSPC])
def test_only_a_file_system_that_cannot_reserve_is_excused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    asked: list[tuple[int, int]] = []

    def reserve(fd: int, begin: int, size: int) -> None:
        asked.append((begin, size))
        raise OSError(number, "no")

    monkeypatch.setattr(os, "posix_fallocate", reserve)
    fd = opened(tmp_path / "a.h5")
    if number == errno.ENOSPC:
        with pytest.raises(OSError, match="no"):
            PLAIN.write(fd, 1000, 500)
    else:
        PLAIN.write(fd, 1000, 500)
        assert asked[-1] == (0, os.fstat(fd).st_size)
    # First with a margin for the metadata, 1 MiB, over 14 bytes a row and the events.
    assert asked[0] == (0, 1000 * 14 + 500 + 2**20)
    os.close(fd)


def test_what_a_file_needs_is_rows_events_and_a_margin() -> None:
    assert needed_bytes(COLUMNS, 10) == 10 * (8 + 4 + 2) + 2**20
    assert needed_bytes(COLUMNS, 10, 77) == 10 * 14 + 77 + 2**20


def test_a_file_as_hdf5_sees_it(tmp_path: Path) -> None:
    fd = opened(tmp_path / "a")
    file = form._SteadyFile(fd)
    assert (file.write(b"abcdef"), file.tell(), file.end) == (6, 6, 6)
    assert file.seek(1) == 1 and file.write(b"XY") == 2
    assert (file.tell(), file.end) == (3, 6)
    assert file.seek(-1, os.SEEK_CUR) == 2 and file.seek(-2, os.SEEK_END) == 4
    piece = bytearray(5)
    assert file.readinto(piece) == 5 and bytes(piece) == b"ef\0\0\0" and file.tell() == 9
    assert file.truncate(3) == 3 == file.end
    assert file.seek(5) == 5 and file.truncate() == 5 == file.end
    os.close(fd)


@posix
def test_all_is_written_though_the_system_takes_it_in_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.pwrite
    monkeypatch.setattr(os, "pwrite", lambda fd, data, offset: real(fd, data[:3], offset))
    fd = opened(tmp_path / "a")
    write_all(fd, b"0123456789", 2)
    os.close(fd)
    assert (tmp_path / "a").read_bytes() == b"\0\x000123456789"


@pytest.mark.parametrize(
    ("column", "accepted"),
    [
        (Column("x y", "m", ""), "unique names"), (Column("1x", "m", ""), "unique names"),
        (Column("ä", "m", ""), "unique names"), (Column("rows", "m", ""), "unique names"),
        (Column("events", "m", ""), "unique names"), (Column("t", "m", ""), "unique names"),
        (Column("x", "m\0", ""), "plain text"), (Column("x", "m", "\ud800"), "plain text"),
        (Column("x", "m", "", "f2"), "f4, f8"), (Column("x", "m", "", "f16"), "f4, f8"),
        (Column("x", "m", "", "c8"), "f4, f8"), (Column("x", "m", "", "bool"), "f4, f8"),
        (Column("x", "m", "", "nonsense"), "f4, f8"),
    ],
)  # fmt: skip
def test_columns_that_no_recording_can_hold_are_refused(column: Column, accepted: str) -> None:
    with pytest.raises(InputError, match=accepted):
        Layout.checked((COLUMNS[0], column), 0.5, {}, "here")


def test_a_recording_needs_a_time() -> None:
    with pytest.raises(InputError, match="include 't'"):
        Layout.checked((COLUMNS[1],), 0.5, {}, "here")
    kinds = ("float64", "<i4", "u8", "single")
    made = Layout.checked([Column(f"t{k}"[: 1 + (k > 0)], "", "", d) for k, d in enumerate(kinds)],
                          1.0, {}, "here")  # fmt: skip
    assert [c.dtype for c in made.columns] == ["f8", "i4", "u8", "f4"]


@pytest.mark.parametrize("dt", [0.0, -1.0, math.inf, math.nan])
def test_a_sample_time_is_above_nothing(dt: float) -> None:
    with pytest.raises(InputError, match="above 0 s"):
        Layout.checked(COLUMNS, dt, {}, "here")


@pytest.mark.parametrize("value", [2**63, -(2**63) - 1, "a\0b", "\ud800", [1], None, b"x"])
def test_attributes_that_hdf5_cannot_hold_are_refused(value: Any) -> None:
    with pytest.raises(InputError, match="attribute 'k'"):
        Layout.checked(COLUMNS, 1.0, {"k": value}, "here")


@pytest.mark.parametrize("key", ["", "a\nb", "format", "sample_time_s", "columns"])
def test_attributes_have_names_of_their_own(key: str) -> None:
    with pytest.raises(InputError, match="printable name"):
        Layout.checked(COLUMNS, 1.0, {key: 1}, "here")


def test_attributes_become_plain_values() -> None:
    given = {"a": np.int32(3), "b": np.float32(0.5), "c": True, "d": "x", "e": 2**63 - 1,
             "f": -(2**63), "g": math.nan}  # fmt: skip
    made = Layout.checked(COLUMNS, 1.0, given, "here").attributes
    assert [type(v) for v in made.values()] == [int, float, int, str, int, int, float]
    assert (made["a"], made["b"], made["e"], made["f"]) == (3, 0.5, 2**63 - 1, -(2**63))


@pytest.mark.parametrize(
    ("values", "kind", "wanted"),
    [
        ([0.5, 1.5, 2.4, -0.6], "i2", [0, 2, 2, -1]),
        ([-128, 127], "i1", [-128, 127]), ([0, 255], "u1", [0, 255]),
        ([127.4, -128.4], "i1", [127, -128]),
        ([0.1, math.inf, math.nan], "f4", [np.float32(0.1), math.inf, math.nan]),
        ([True, False], "f8", [1.0, 0.0]),
    ],
)  # fmt: skip
def test_numbers_take_their_columns_form(values: Any, kind: str, wanted: Any) -> None:
    """The nearest whole number, halves to the even one."""
    found = as_column(values, Column("x", "", "", kind), "here")
    assert found.dtype == np.dtype(kind)
    np.testing.assert_array_equal(found, np.array(wanted, kind))


@pytest.mark.parametrize(
    ("values", "kind", "row"),
    [([1, 128], "i1", 1), ([-129, 0], "i1", 0), ([0, -1], "u1", 1), ([1.0, 256.0], "u1", 1),
     ([0.0, math.nan], "i4", 1), ([math.inf], "i4", 0), ([0.0, 1e39], "f4", 1),
     ([2**63], "i8", 0), ([127.6], "i1", 0), ([1, 1, 300, 400], "u1", 2)],
)  # fmt: skip
def test_numbers_that_do_not_fit_are_refused_with_their_row(
    values: Any, kind: str, row: int
) -> None:
    with pytest.raises(InputError, match=f"column 'x', row {row} of the block"):
        as_column(values, Column("x", "", "", kind), "here")


@pytest.mark.parametrize("values", [[[1.0]], 1.0, ["a"], [1j], [None]])
def test_what_is_no_row_of_numbers_is_refused(values: Any) -> None:
    with pytest.raises(InputError, match="a row of numbers"):
        as_column(values, COLUMNS[0], "here")


def test_a_block_has_an_array_for_each_column_equally_long() -> None:
    block = as_block([[0.0, 1.0], [2.0, 3.0], [4, 5]], COLUMNS, "here")
    assert [a.tolist() for a in block] == [[0.0, 1.0], [2.0, 3.0], [4, 5]]
    with pytest.raises(InputError, match=r"2 arrays .* 3 columns"):
        as_block([[0.0], [1.0]], COLUMNS, "here")
    with pytest.raises(InputError, match=r"\[1, 2\] rows"):
        as_block([[0.0], [1.0, 2.0], [1]], COLUMNS, "here")


def test_what_was_noted_comes_back() -> None:
    one = Noted(1.5, "move", "me", "begun", {"id": 3, "where": Path("x")})
    two = Noted(math.nan, "stop", "", "ended", {})
    found = parse_notes(one.line() + two.line())
    assert found[0] == one._replace(facts={"id": 3, "where": "x"})
    assert math.isnan(found[1].t) and found[1][1:] == two[1:]
    assert b"NaN" not in two.line()
