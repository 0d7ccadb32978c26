"""Texts with more than one heading: tables one after the other, headings in mid-file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.files import _text
from macromicro.files._text import UnreadLinesWarning
from macromicro.files.reading import read_table
from macromicro.files.table import Table


def rows(*columns: Sequence[float | str], mark: str = ",") -> str:
    return "".join(mark.join(map(str, row)) + "\n" for row in zip(*columns, strict=True))


T, U, X = [0.0, 0.5, 1.0, 1.5], [1.0, 2.0, 3.0, 4.0], [7.0, 5.0, 6.0, 8.0]


def table(place: Path, text: str) -> Table:
    path = place / "a.csv"
    path.write_text(text)
    return read_table(path)


def test_the_longest_table_has_the_plain_names(tmp_path: Path) -> None:
    text = "rig 3\ngain,mass_kg\n35,1\n36,2\n\nt,u,x\ns,V,mm\n" + rows(T, U, X)
    with pytest.warns(UnreadLinesWarning, match=r"2 tables .* from line 8 on, .* 1\.gain, \.\.\."):
        found = table(tmp_path, text)
    assert list(found.columns) == ["t", "u", "x", "1.gain", "1.mass_kg"]
    assert found.units == {"t": "s", "u": "V", "x": "mm", "1.gain": "", "1.mass_kg": "kg"}
    both = found.several(["x", "1.gain"])
    assert both["x"].tolist() == X and both["1.gain"].tolist() == [35.0, 36.0]


@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_columns_in_another_order_are_those_of_the_first_heading(tmp_path: Path, mark: str) -> None:
    text = mark.join("tux") + "\n" + rows(T, U, X, mark=mark)
    found = table(tmp_path, text + mark.join("xtu") + "\n" + rows(X, T, U, mark=mark))
    for name, values in (("t", T), ("u", U), ("x", X)):
        assert found.columns[name].tolist() == values * 2


def test_a_heading_may_come_late(tmp_path: Path) -> None:
    """Below rows of as many cells: those rows are of its columns, too."""
    found = table(tmp_path, rows(T, U, X) + "t_s,u_V,x_mm\n" + rows(T, U, X))
    assert found.units == {"t_s": "s", "u_V": "V", "x_mm": "mm"} and not found.note
    assert found.columns["x_mm"].tolist() == X * 2


def test_numbers_above_a_heading_that_are_no_table_are_left(tmp_path: Path) -> None:
    found = table(tmp_path, "12,5\nt,u,x\n" + rows(T, U, X))
    assert list(found.columns) == ["t", "u", "x"] and found.columns["u"].tolist() == U


def test_words_between_rows_are_no_heading(tmp_path: Path) -> None:
    text = "t u x\n" + rows(T, U, X, mark=" ") + "motor switched off\n" + rows(T, U, X, mark=" ")
    found = table(tmp_path, text + "# the very end\n" + rows(T, U, X, mark=" "))
    with pytest.warns(UnreadLinesWarning, match="line 6, u: 'switched' is not a number"):
        assert np.nansum(found.columns["u"]) == 3.0 * sum(U)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_large_text_is_searched_for_headings_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, encoding: str
) -> None:
    """Far behind what is looked at first, of a text whose lines are not all kept."""
    for name, size in (("_WHOLE", 1000), ("SAMPLE", 400), ("_NEAR", 110)):
        monkeypatch.setattr(_text, name, size)
    first = [[float(k + j) for k in range(1000)] for j in range(3)]
    text = "t_s,u_V,x_mm\n" + rows(*first) + "motor off\n" + "x_mm,u_V,t_s\n" + rows(X, U, T)
    path = tmp_path / "a.csv"
    path.write_text(text + "\nf_Hz,gain_dB\n" + rows(T, X), encoding=encoding)
    found = read_table(path)
    assert list(found.columns) == ["t_s", "u_V", "x_mm", "2.f_Hz", "2.gain_dB"]
    values = found.several(list(found.columns))
    for name, begin, end in zip(("t_s", "u_V", "x_mm"), first, (T, U, X), strict=True):
        assert values[name].tolist() == begin + end
    assert values["2.f_Hz"].tolist() == T and values["2.gain_dB"].tolist() == X


SEGMENT = """
Channels\t2
Samples\t3\t3
Y_Unit_Label\tVolts\tmm
X0\t{begin}\t{begin}
Delta_X\t0.5\t0.5
***End_of_Header***
X_Value\t{names}\tComment
"""


@pytest.mark.parametrize("given", ["One", "No"])
def test_segments_of_labview_are_one_after_the_other(tmp_path: Path, given: str) -> None:
    """Each with its own first time, in its rows or its header; others have other channels."""
    text = f"LabVIEW Measurement\nX_Columns\t{given}\n***End_of_Header***\n"
    for begin in (0.0, 10.0):
        text += SEGMENT.format(begin=begin, names="drive\tplace")
        times = [f"{begin + t}" if given == "One" else "" for t in T[:3]]
        text += rows(times, U[:3], X[:3], mark="\t")
    path = tmp_path / "a.lvm"
    path.write_text(text)
    found = read_table(path)
    values = found.several(["X_Value", "drive", "place"])
    assert values["X_Value"].tolist() == [0.0, 0.5, 1.0, 10.0, 10.5, 11.0]
    assert values["drive"].tolist() == U[:3] * 2 and values["place"].tolist() == X[:3] * 2
    assert found.units == {"X_Value": "s", "drive": "V", "place": "mm"}
    path.write_text(text + SEGMENT.format(begin=0.0, names="load\tplace"))  # cut off
    assert read_table(path).columns["drive"].tolist() == U[:3] * 2
    path.write_text(path.read_text() + rows([""] * 2, U[:2], X[:2], mark="\t"))
    with pytest.warns(UnreadLinesWarning, match="columns of others are called 2.X_Value"):
        assert read_table(path).columns["2.load"].tolist() == U[:2]


@given(
    counts=st.lists(st.integers(2, 30), min_size=1, max_size=4),
    gap=st.sampled_from(["", "\n", "\nnext table\n\n"]),
    mark=st.sampled_from([",", ";", "\t"]),
)
@settings(max_examples=40, deadline=None)
@pytest.mark.filterwarnings("ignore::macromicro.files._text.UnreadLinesWarning")
def test_every_number_is_found_under_its_name(
    tmp_path_factory: pytest.TempPathFactory, counts: list[int], gap: str, mark: str
) -> None:
    """Tables of different columns, each of its own length."""
    text, wanted = "", []
    for k, count in enumerate(counts):
        names = [f"a{k}", f"b{k}", *(["c"] * (k % 2))]
        columns = [[100.0 * k + 10.0 * j + i for i in range(count)] for j in range(len(names))]
        text += gap * bool(k) + mark.join(names) + "\n" + rows(*columns, mark=mark)
        wanted.append(dict(zip(names, columns, strict=True)))
    found = table(tmp_path_factory.mktemp("tables"), text)
    longest = max(range(len(counts)), key=lambda k: (counts[k], -k))
    for k, columns_of_one in enumerate(wanted):
        for name, values in columns_of_one.items():
            own = name if k == longest else f"{k + 1}.{name}"
            assert found.columns[own].tolist() == values


def test_titles_and_a_table_of_one_row_are_left(tmp_path: Path) -> None:
    """As an instrument writes its result above its measurements; a cut row is said to be one."""
    one = "Data table [{}]\nTime [s]\tV+ [V]\tD1 [nm]\t\n" + rows(T, U, X, [""] * 4, mark="\t")
    head = "OwnResult\nTable 1\nTable No [#]\tVc+ [V]\n1\t410.2\n\nTable 2\nSample\town\n\n"
    found = table(tmp_path, head + "\n".join(one.format(k) for k in (1, 2, 3)))
    assert list(found.columns) == ["Time [s]", "V+ [V]", "D1 [nm]", "column 4"]
    assert found.columns["D1 [nm]"].tolist() == X * 3
    cut = table(tmp_path, head + one.format(1) + "1.7\t3\n\n" + one.format(2))
    with pytest.warns(UnreadLinesWarning, match="line 15: 2 cells instead of 4; left out"):
        assert cut.columns["V+ [V]"].tolist() == U * 2


CELLS = st.sampled_from(
    [
        "t",
        "u_V",
        "x [mm]",
        "run",
        "",
        "nan",
        "12",
        "-3.5",
        "1,5",
        "10:00:01",
        "2024-03-01",
        "mm",
        "#",
    ]
)
LINES = st.one_of(
    st.lists(CELLS, min_size=1, max_size=4),
    st.lists(st.floats(-9.0, 9.0).map("{:.3f}".format), min_size=1, max_size=4),
    st.sampled_from([[""], ["Table 2"], ["# remark"], ["---"], ["% t u x"]]),
)


@given(st.lists(LINES, max_size=25), st.sampled_from([",", ";", "\t", " "]))
@settings(max_examples=150, deadline=None)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_any_text_is_read_or_refused_in_words(
    tmp_path_factory: pytest.TempPathFactory, lines: list[list[str]], mark: str
) -> None:
    """Each column has numbers, or a message says why it has none."""
    text = "\n".join(mark.join(line) for line in lines)
    try:
        found = table(tmp_path_factory.mktemp("any"), text)
    except InputError:
        return
    for name in found.columns:
        try:
            values = found.several([name])[name]
        except InputError as error:
            assert "a.csv" in str(error)
        else:
            assert values.dtype == np.float64 and 0 < len(values) <= len(lines)
