"""A recording as a table of pandas, and in words."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from macromicro.columns import Column
from macromicro.errors import InputError, MacromicroError
from macromicro.files import reading
from macromicro.recording import Recording

COLUMNS = (
    Column("t", "s", "time"),
    Column("hall_voltage", "V", "Hall sensor"),
    Column("phase", "1", "phase", "i1"),
)


def made(**attributes: str | int | float) -> Recording:
    t = 0.5 * np.arange(4)
    return Recording.from_arrays(COLUMNS, [t, t / 8.0, [0, 1, 2, 2]], 0.5, attributes)


def test_a_dataframe_has_time_as_index_and_units_beside() -> None:
    pytest.importorskip("pandas")
    table = made(seed=7).to_dataframe()
    assert table.index.name == "t" and table.index.tolist() == [0.0, 0.5, 1.0, 1.5]
    assert list(table.columns) == ["hall_voltage", "phase"]
    assert table["hall_voltage"].loc[1.0] == 0.125
    assert table["phase"].dtype == np.int8
    assert table.attrs["units"] == {"t": "s", "hall_voltage": "V", "phase": "1"}
    assert table.attrs["meanings"]["hall_voltage"] == "Hall sensor"
    assert table.attrs["seed"] == 7 and table.attrs["sample_time_s"] == 0.5


def test_a_dataframe_of_a_file(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    made(seed=7).save(tmp_path / "a.h5")
    loaded = Recording.load(tmp_path / "a.h5").to_dataframe()
    pandas.testing.assert_frame_equal(loaded, made(seed=7).to_dataframe())


@pytest.mark.parametrize("package", ["pandas", "xarray"])
def test_without_the_package_the_remedy_is_said(
    package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = made()
    monkeypatch.setitem(sys.modules, package, None)
    words = rf"{package} is not installed. Install it: pip install 'macromicro\[{package}\]'"
    with pytest.raises(MacromicroError, match=words):
        run.to_dataframe() if package == "pandas" else run.to_xarray()


def test_matlab_s_file_has_columns_units_and_origin(tmp_path: Path) -> None:
    """Read back by SciPy; names as MATLAB can have them (63 characters, a letter first)."""
    long = "law_" + 70 * "a"
    columns = (*COLUMNS, Column("_own", "mm", "hidden"), Column(long, "V", "long"))
    t = 0.5 * np.arange(4)
    run = Recording.from_arrays(columns, [t, t / 8.0, [0, 1, 2, 2], t, -t], 0.5, {"seed": 7})
    run.to_mat(tmp_path / "a.mat")
    found = loadmat(tmp_path / "a.mat", simplify_cells=True)
    names = ["t", "hall_voltage", "phase", "x_own", long[:63]]
    assert [n for n in found if not n.startswith("__")] == [
        *names,
        "units",
        "meanings",
        "recording",
    ]
    for name, column in zip(names, columns, strict=True):
        np.testing.assert_array_equal(found[name], run[column.name])
        assert re.fullmatch("[a-zA-Z][a-zA-Z0-9_]{0,62}", name)
    assert found["phase"].dtype == np.int8
    assert loadmat(tmp_path / "a.mat")["t"].shape == (4, 1)
    assert found["units"] == dict(zip(names, ["s", "V", "1", "mm", "V"], strict=True))
    assert found["meanings"]["hall_voltage"] == "Hall sensor"
    assert found["recording"] == {"seed": 7, "sample_time_s": 0.5}


def test_names_that_become_one_in_matlab_are_refused(tmp_path: Path) -> None:
    for first, second in (("a" * 64, "a" * 65), ("_a", "x_a"), ("units", "b")):
        columns = (COLUMNS[0], Column(first, "V", ""), Column(second, "V", ""))
        run = Recording.from_arrays(columns, [[0.0]] * 3, 0.5, {})
        with pytest.raises(InputError, match=r"a.mat, column .*its name in MATLAB"):
            run.to_mat(tmp_path / "a.mat")
    assert not list(tmp_path.iterdir())


def test_what_identifies_reads_a_recording_s_mat_file(tmp_path: Path) -> None:
    made(seed=7).to_mat(tmp_path / "a.mat")
    table = reading.read_table(tmp_path / "a.mat")
    assert list(table.columns) == ["t", "hall_voltage", "phase"]


def test_a_part_has_the_rows_within(tmp_path: Path) -> None:
    made(seed=7).save(tmp_path / "a.h5")
    run = Recording.load(tmp_path / "a.h5")
    assert run.part(0.5, 1.0)["t"].tolist() == [0.5, 1.0]
    assert run.part(end=0.6)["phase"].tolist() == [0, 1]
    assert run.part(0.6)["t"].tolist() == [1.0, 1.5] and len(run.part()) == 4
    assert run.part(0.6).attributes == {"seed": 7} and run.part(0.6)["phase"].dtype == np.int8
    for span in ((0.6, 0.9), (2.0, None), (None, -1.0), (1.0, 0.5)):
        with pytest.raises(InputError, match=r"rows go from 0 to 1\.5 s"):
            run.part(*span)


def test_shown_are_rows_duration_origin_and_columns(tmp_path: Path) -> None:
    run = made(programme="Ramp", seed=7)
    assert repr(run) == (
        "<Recording: 4 rows, 2 s at 2 Hz; Ramp, seed 7\n  t [s], hall_voltage [V], phase [1]>"
    )
    assert repr(made()).startswith("<Recording: 4 rows, 2 s at 2 Hz\n")
    assert "ended early" in repr(made(finished=0)) and "early" not in repr(made(finished=1))
    run.save(tmp_path / "a.h5")
    loaded = Recording.load(tmp_path / "a.h5")
    assert str(tmp_path / "a.h5") in repr(loaded)
    assert not loaded._arrays  # nothing was read for it


def test_many_columns_are_wrapped_and_keep_their_units() -> None:
    columns = [Column("t", "s", ""), *(Column(f"signal_{k}", "mm/s", "") for k in range(30))]
    text = repr(Recording.from_arrays(columns, np.zeros((31, 1)), 1e-3, {}))
    assert text.startswith("<Recording: 1 row, ") and max(map(len, text.splitlines())) <= 100
    assert all(f"signal_{k} [mm/s]" in text for k in range(30))
