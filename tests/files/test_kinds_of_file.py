"""A file is told by its content first, then by the ending of its name."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.errors import InputError
from macromicro.files.reading import read_table


@pytest.mark.parametrize(
    ("name", "found"),
    [("a.mat", "cannot be read"), ("a.MAT", "cannot be read"), ("a.xyz", "is not known")],
)
def test_a_text_is_no_mat_file_whatever_its_name_says(
    tmp_path: Path, name: str, found: str
) -> None:
    (tmp_path / name).write_text("t_s,u_V\n0,1\n")
    with pytest.raises(InputError, match=found):
        read_table(tmp_path / name)


@pytest.mark.parametrize("name", ["a.h5", "a.hdf5"])
def test_a_text_is_no_recording(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("t_s,u_V\n0,1\n")
    with pytest.raises(InputError):
        read_table(tmp_path / name)


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.tsv", "a.dat", "a"])
def test_a_text_is_a_table(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("t_s,u_V\n0,1\n")
    assert read_table(tmp_path / name).columns["u_V"].tolist() == [1.0]
