"""Columns by name out of CSV, MAT and recordings, with units, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.files.naming import split_unit
from macromicro.files.reading import is_forc, read_table
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.picking import (
    RUN,
    MissingRowsWarning,
    Role,
    UnitWarning,
    find_saturated,
    parse_pairs,
    pick,
    runs,
)
from macromicro.recording import Recording

T = Role("t", "time", ("t", "time"), ("s",))
U = Role("u", "voltage", ("u", "volts"), ("V",))
X = Role("x", "position", ("x", "position"), ("m", "counts"))
ROLES = (T, U, X)


def written(place: Path, text: str, name: str = "a.csv") -> Path:
    path = place / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(path: Path, **wanted: str) -> str:
    with pytest.raises(InputError) as caught:
        pick(read_table(path), ROLES, wanted)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("t_s", ("t", "s")),
        ("x_mm", ("x", "mm")),
        ("u [V]", ("u", "V")),
        ("speed (mm/s)", ("speed", "mm/s")),
        ("v_mm_per_s", ("v", "mm/s")),
        ("plate_C", ("plate", "degC")),
        ("macro_position", ("macro_position", "")),
        ("x", ("x", "")),
        ("x_counts", ("x", "counts")),
    ],
)
def test_unit_in_a_name(name: str, parts: tuple[str, str]) -> None:
    assert split_unit(name) == parts


def test_csv_becomes_si(tmp_path: Path) -> None:
    path = written(tmp_path, "# rig 3\nt_ms,u_mV,x_mm\n0,1000,1\n10,-500,2\n")
    found = pick(read_table(path), ROLES, {})
    np.testing.assert_allclose(found.values["t"], [0.0, 0.01], rtol=1e-15)
    np.testing.assert_allclose(found.values["u"], [1.0, -0.5], rtol=1e-15)
    np.testing.assert_allclose(found.values["x"], [1e-3, 2e-3], rtol=1e-15)
    assert found.units == {"t": "s", "u": "V", "x": "m"}
    assert found.names["x"] == "x_mm"


def test_semicolons_bring_a_decimal_comma(tmp_path: Path) -> None:
    path = written(tmp_path, "t_s;u_V;x_m\n0,5;1,25;3\n1,0;-2,5;4\n")
    found = pick(read_table(path), ROLES, {}).values
    assert found["t"].tolist() == [0.5, 1.0] and found["u"].tolist() == [1.25, -2.5]


def test_counts_stay_counts(tmp_path: Path) -> None:
    found = pick(read_table(written(tmp_path, "t_s,u_V,x_counts\n0,1,7\n1,1,8\n")), ROLES, {})
    assert found.units["x"] == "counts" and found.values["x"].tolist() == [7.0, 8.0]


def test_columns_named_by_hand(tmp_path: Path) -> None:
    """By their whole name, without the unit, or with a unit that the name does not tell."""
    path = written(tmp_path, "clock_ms,amp_V,scale\n0,1,5\n10,1,6\n")
    found = pick(read_table(path), ROLES, {"t": "clock", "u": "amp_V", "x": "scale:mm"})
    np.testing.assert_allclose(found.values["x"], [5e-3, 6e-3])
    assert found.values["t"][1] == pytest.approx(0.01)


def test_mat_vectors_are_columns_and_scalars_constants(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "a.mat"
    content = {"t": np.arange(3.0)[:, None], "u": np.ones((1, 3)), "x": np.ones(3), "gain": 35.0}
    savemat(path, {**content, "label": "EMPS", "both": np.array([[1.0, 2.0], [3.0, 4.0]])})
    table = read_table(path)
    assert set(table.columns) == {"t", "u", "x", "both1", "both2"}
    assert table.columns["both2"].tolist() == [2.0, 4.0]
    assert table.constants == {"gain": 35.0}


def test_a_recording_tells_its_units_and_hides_the_truth(tmp_path: Path) -> None:
    columns = [
        Column("t", "s", "time"),
        Column("position", "count", "encoder"),
        Column("true_position", "mm", "bench truth"),
    ]
    made = Recording.from_arrays(columns, [np.arange(4.0)] * 3, 1.0, {"delay": 1, "version": "x"})
    made.save(tmp_path / "a.h5")
    table = read_table(tmp_path / "a.h5")
    assert table.units == {"t": "s", "position": "counts"}
    assert table.constants == {"delay": 1.0}


def test_missing_columns_list_those_there(tmp_path: Path) -> None:
    message = refused(written(tmp_path, "t_s,force_N,x_mm\n0,1,2\n"))
    assert "no column for u (voltage)" in message and "t_s, force_N, x_mm" in message
    assert "--columns u=COLUMN" in message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0,1,2\n3,4,5\n", "heading"),
        ("t_s,u_V,u_V,x_m\n0,1,2,3\n", "'u_V' occurs twice"),
        ("t_s,u_V,x_mm\n0,1\n", "line 2: the heading has 3 cells, this line 2"),
        ("t_s,u_V,x_mm\n0,1,2\n1,1,two\n2,1,three\n", "line 3, x_mm: 'two'"),
        ("t_s,u_mm,x_mm\n0,1,2\n", "u_mm: 'mm'"),
        ("t_s,u_V,x_mm\n0,nan,2\n", "every row has a missing number"),
        ("# only words\n", "nothing but comments"),
        ("", "the file is empty"),
    ],
)
def test_what_a_csv_may_not_be(tmp_path: Path, text: str, said: str) -> None:
    assert said in refused(written(tmp_path, text))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.h5", b"no recording", "not a recording"),
        ("a.mat", b"MATLAB 5.0 MAT-file" + b"\0" * 200, "cannot be read"),
        ("a.png", b"\x89PNG", "is not known"),
        ("a.csv", bytes(range(255)), "UTF-8"),
    ],
)
def test_wrong_kinds_of_file(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    assert said in refused(path)


def test_no_file_and_a_directory(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path / "nothing.csv")
    assert "a directory" in refused(tmp_path)
    assert not is_forc(written(tmp_path, "t,u\n0,1\n"))


def test_rows_with_nan_are_left_out_and_said(tmp_path: Path) -> None:
    path = written(tmp_path, "t_s,u_V,x_mm\n0,1,2\n1,nan,2\n2,1,\n3,1,4\n")
    with pytest.warns(MissingRowsWarning, match="2 of 4 rows.*row 2.*left out"):
        found = pick(read_table(path), ROLES, {})
    assert found.values["t"].tolist() == [0.0, 3.0]


def test_no_unit_is_said_where_it_matters(tmp_path: Path) -> None:
    path = written(tmp_path, "t,u,x\n0,1,2\n1,1,3\n")
    with pytest.warns(UnitWarning, match="u has no unit; taken as V"):
        found = pick(read_table(path), ROLES, {})
    assert found.units == {"t": "s", "u": "V", "x": ""}


def test_runs_are_cut_where_their_column_changes(tmp_path: Path) -> None:
    path = written(tmp_path, "t_s,u_V,x_m,run\n0,1,2,1\n1,1,3,1\n0,2,4,2\n1,2,5,2\n2,2,6,2\n")
    parts = runs(pick(read_table(path), (*ROLES, RUN), {}))
    assert [p["x"].tolist() for p in parts] == [[2.0, 3.0], [4.0, 5.0, 6.0]]
    assert "run" not in parts[0]


def test_columns_option() -> None:
    assert parse_pairs(["x=pos,u=volts", "t=clock"]) == {"x": "pos", "u": "volts", "t": "clock"}
    for bad in ("x", "=pos", "x="):
        with pytest.raises(InputError, match="name=column"):
            parse_pairs([bad])


@given(low=st.floats(-0.88, -0.75), high=st.floats(0.75, 0.88), seed=st.integers(0, 99))
@example(low=-0.8759769563272227, high=0.7759006979828134, seed=12)  # noise in few steps
def test_a_saturated_sensor_is_found_where_it_is(low: float, high: float, seed: int) -> None:
    """A swing that a sensor of a smaller range saw, with noise below the rail."""
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(2000)
    full = np.sin(np.linspace(0.0, 20.0, 2000)) + noise
    with pytest.warns(SaturationWarning, match="left out"):
        where = find_saturated(np.clip(full, low, high), "x", "left out")
    np.testing.assert_array_equal(where, (full <= low) | (full >= high))


@given(seed=st.integers(0, 99), rest=st.integers(100, 400))
def test_an_axis_at_rest_is_no_saturated_sensor(seed: int, rest: int) -> None:
    """A smooth move between two rests, in counts of an encoder or with noise."""
    t = np.linspace(0.0, 1.0, 600)
    move = 2000.0 * (t - np.sin(2.0 * np.pi * t) / (2.0 * np.pi))
    x = np.concatenate([np.zeros(rest), move, np.full(rest, 2000.0)])
    assert not find_saturated(np.round(x), "x").any()
    assert not find_saturated(x + np.random.default_rng(seed).standard_normal(len(x)), "x").any()


def test_mostly_saturated_is_refused() -> None:
    x = np.clip(10.0 * np.sin(np.linspace(0.0, 20.0, 2000)), -1.0, 1.0)
    with pytest.warns(SaturationWarning), pytest.raises(InputError, match="saturated in"):
        find_saturated(x, "x")
