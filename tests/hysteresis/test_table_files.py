"""Tables and curves on disk."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.hysteresis import FodTable, from_density
from macromicro.hysteresis.table_files import _number, load_table, save_table

WEIGHTS = np.tril(np.random.default_rng(5).random((8, 8)))
MODEL = FodTable.from_everett(from_density(WEIGHTS, 20.0, 0.7, 9), -0.3, 3.9)


def fitted() -> FodTable:
    curves = []
    for start in (21.3, 23.0, 24.5, 25.6):
        u = np.linspace(25.6, start, 30)[::-1]
        curves.append((u, MODEL.curve(start, u, "ascending")))
    curves[1][1][4] = np.nan
    with pytest.warns(UserWarning, match="not finite"):
        return FodTable.from_curves(curves[:3], "ascending", shape="monotone", nodes=12)


@pytest.mark.parametrize("name", ["table.h5", "table.HDF5", "table.csv"])
@pytest.mark.parametrize("table", [MODEL, fitted()], ids=["model", "fitted"])
def test_a_table_comes_back(tmp_path: Path, name: str, table: FodTable) -> None:
    save_table(table, tmp_path / name)
    back = load_table(tmp_path / name)
    same = ("lo", "step", "f_low", "kind", "shape", "smooth", "n")
    assert [getattr(back, key) for key in same] == [getattr(table, key) for key in same]
    assert np.allclose(back.values, table.values, rtol=0.0, atol=4e-15)
    if not name.endswith("csv"):
        assert np.array_equal(back.values, table.values)
        assert len(back.raw) == len(table.raw)
        for one, other in zip(back.raw, table.raw, strict=True):
            assert np.array_equal(one, other, equal_nan=True)


def test_csv_is_the_lookup_table_of_figure_5_8(tmp_path: Path) -> None:
    save_table(MODEL, tmp_path / "table.csv")
    rows = [line.split(",") for line in (tmp_path / "table.csv").read_text().splitlines()[1:]]
    assert [float(cell) for cell in rows[0][1:]] == MODEL.grid.tolist()
    assert float(rows[6][0]) == MODEL.grid[5]
    expected = float(MODEL.curve(MODEL.grid[5], MODEL.grid[2]))
    assert float(rows[6][3]) == pytest.approx(expected, abs=1e-14)
    assert rows[6][7:] == ["", "", ""]


def test_a_table_from_a_spreadsheet(tmp_path: Path) -> None:
    """No comment line, no extra digits: f_{M,m} by hand."""
    path = tmp_path / "mine.csv"
    path.write_text("M,0,10,20\n0,1,,\n10,1,2,\n20,1,4,5\n")
    table = load_table(path)
    assert (table.lo, table.step, table.f_low, table.span) == (0.0, 10.0, 1.0, 4.0)
    assert table.values.tolist() == [[0, 0, 0], [1, 0, 0], [4, 1, 0]]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("M,0,10\n0,1,\n", "as many full rows"),
        ("M,0,10,20\n0,1,,\n10,1,2\n20,1,4,5\n", "as many full rows"),
        ("M,0,10,30\n0,1,,\n10,1,2,\n30,1,4,5\n", "equal steps"),
        ("M,20,10,0\n20,1,,\n10,1,2,\n0,1,4,5\n", "equal steps"),
        ("M,0,10,20\n0,1,,\n11,1,2,\n20,1,4,5\n", "row 2"),
        ("M,0,10,20\n0,1,,\n9,1,2,\n20,1,4,5\n", "row 2"),
        ("M,0,10,20\n0,1,,\n10,1,warm,\n20,1,4,5\n", "row 2"),
        ("M,0,10,20\n0,1,,\n10,1,,\n20,1,4,5\n", "row 2"),
        ("M,0,10,20\n0,1,3,\n10,1,2,\n20,1,4,5\n", "m > M"),
        ("M,0,10,20\n0,1,,\n10,1,2,\n20,1,4,1\n", "saturations"),
        ("# kind=up\nM,0,10,20\n0,1,,\n10,1,2,\n20,1,4,5\n", "descending"),
        ("", "empty"),
        ("# nothing but\n# remarks\n", "number 0 and 0"),
    ],
)
def test_broken_csv_is_refused(tmp_path: Path, text: str, named: str) -> None:
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(InputError, match=named):
        load_table(tmp_path / "table.csv")


def test_other_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("no HDF5")
    with h5py.File(tmp_path / "other.h5", "w") as store:
        store["x"] = 1.0
    save_table(MODEL, tmp_path / "short.h5")
    with h5py.File(tmp_path / "short.h5", "a") as store:
        del store["values"]
    for name in ("text.h5", "other.h5", "short.h5", "none.h5", "none.csv", "table.txt"):
        with pytest.raises(InputError, match=name.split(".")[0]):
            load_table(tmp_path / name)
    with pytest.raises(InputError, match=r"\.csv"):
        save_table(MODEL, tmp_path / "table.txt")
    with pytest.raises(InputError, match="written"):
        save_table(MODEL, tmp_path / "no folder" / "table.csv")
    with pytest.raises(InputError, match="written"):
        save_table(MODEL, tmp_path / "no folder" / "table.h5")


@pytest.mark.parametrize("scale", [1e-9, 1.0, -1e9])
def test_a_setting_counts_as_far_as_the_table_says_the_same(scale: float) -> None:
    """To a millionth of it, for a comment line has more digits; whatever the unit."""
    for part, near in ((1.0 + 9e-7, True), (1.0 - 9e-7, True), (1.0 + 2e-6, False),
                       (1.0 - 2e-6, False)):  # fmt: skip
        found = _number({"lo": repr(part * scale)}, "lo", scale)
        assert found == (part * scale if near else scale)
    assert _number({"smooth": "7.5"}, "smooth", 0.0) == 7.5
    assert _number({"lo": "far"}, "lo", scale) == _number({}, "lo", scale) == scale
