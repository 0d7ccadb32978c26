"""Texts as loggers, spreadsheets, MATLAB, LabVIEW and simulators write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.files._layout import MISSING, layouts, split
from macromicro.files._text import UnreadLinesWarning, pieces
from macromicro.files.reading import read_table
from macromicro.files.table import Table

T, U, X = [0.0, 0.5, 1.0], [1.25, -2.5, 3.0], [10.0, 20.5, 30.0]
LVM = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t.
X_Columns\t{columns}
***End_of_Header***\t
\t
Channels\t2\t
Y_Unit_Label\tVolts\tmm
X0\t0.0\t0.0
Delta_X\t0.5\t0.5
***End_of_Header***\t
X_Value\tdrive\tplace\tComment
"""


def lvm(columns: str) -> str:
    times = [""] * 3 if columns == "No" else ["0.000", "0.500", "1.000"]
    rows = zip(times, U, X, strict=True)
    return LVM.format(columns=columns) + "".join(f"{t}\t{u}\t{x}\n" for t, u, x in rows)


def table(place: Path, text: str, encoding: str = "utf-8", name: str = "a.txt") -> Table:
    path = place / name
    path.write_bytes(text.encode(encoding))
    return read_table(path)


def holds(found: Table, *names: str) -> bool:
    """Whether columns of these names hold the numbers above."""
    got = found.several(list(names))
    pairs = zip(names, (T, U, X), strict=True)
    return all(np.allclose(got[name], values, rtol=1e-15, atol=0.0) for name, values in pairs)


@pytest.mark.parametrize(
    "text",
    [
        "t,u,x\n0,1.25,10\n0.5,-2.5,20.5\n1,3,30\n",
        "t;u;x\n0;1,25;10\n0,5;-2,5;20,5\n1;3;30\n",
        "t;u;x\n0;1,25;10\n0.5;-2.5;20,5\n1;3;30\n",
        "t,u,x\r0,1.25,10\r0.5,-2.5,20.5\r1,3,30\r",
        "t;u;x\r0;1,25;10\r# warm\r0,5;-2,5;20,5\r1;3;30",
        "    t     u    x\n  (s)   (V)  (m)\n ----  ---- ----\n0 1.25 10\n0.5 -2.5 20.5\n1 3 30\n",
        "t,u,x\n=====\n0,1.25,10\n0.5,-2.5,20.5\n1,3,30\n",
        "t\tu\tx\r\n0\t1,25\t10\r\n0,5\t-2,5\t20,5\r\n1\t3\t30\r\n",
        "  t   u\tx  \n 0  1.25  10 \n0.5 -2.5\t20.5\n\n1   3   30",
        "t u x\r\n0 1.25 10 \r\n0.5 -2.5 20.5\r\n1 3 30\r\n",
        "t u x\n0 1,25 10\n0,5 -2,5 20,5\n1 3 30\n",
        't,u,x\n0,"1,25",10\n"0,5","-2,5","20,5"\n1,3,30\n',
        '"t";"u";"x"\n"0";"1.25";"10"\n"0.5";"-2.5";"20.5"\n"1";"3";"30"\n',
        "t,u,x,\n0,1.25,10,\n0.5,-2.5,20.5,\n1,3,30,\n",
        "t,u,x\n0,1.25,10,\n0.5,-2.5,20.5,\n1,3,30,\n",
        "# t u x\n0.0e+00 1.25e+00 1.0e+01\n5.0e-01 -2.5e+00 2.05e+01\n1.0e+00 3.0e+00 3.0e+01\n",
        "% rig 3, warm\n%t, u, x\n0,1.25,10\n0.5,-2.5,20.5\n1,3,30\n",
        "Rig 3 on a Monday.\nOperator: me, 5 of 6\n\nt,u,x\n0,1.25,10\n0.5,-2.5,20.5\n1,3,30\n",
        "t,u,x\n+0,+1.25,+10\n 0.5 , -2.5 , 20.5 \n1,3,30\n# said in between\n",
        "t,note,u,x\n0,begin,1.25,10\n0.5,,-2.5,20.5\n1,ends here,3,30\n",
        "t|u|x\n0|1.25|10\n0.5|-2.5|20.5\n1|3|30\n",
        "t,u,x\n0,1.25D0,10\n5d-1,-2.5,20.5\n1,3,30\n",
    ],
)
def test_one_record_in_many_spellings(tmp_path: Path, text: str) -> None:
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "utf-16-le"):
        assert holds(table(tmp_path, text, encoding), "t", "u", "x")


@pytest.mark.parametrize(
    ("text", "names", "units"),
    [
        ("t,u,x\ns,V,mm\n0,1.25,10\n0.5,-2.5,20.5\n1,3,30\n", "tux", ("s", "V", "mm")),
        ("t u x\n(sec) (Volts) (in)\n0 1.25 10\n0.5 -2.5 20.5\n1 3 30", "tux", ("s", "V", "inch")),
        (
            "Time (s)  Drive [V]  Place (µm)\n0 1.25 10\n.5 -2.5 20.5\n1 3 30",
            ("Time (s)", "Drive [V]", "Place (µm)"),
            ("s", "V", "um"),
        ),
        (
            '"time","der(x)","x[1]"\n0,1.25,10\n.5,-2.5,20.5\n1,3,30',
            ("time", "der(x)", "x[1]"),
            ("", "", ""),
        ),
        (
            lvm("One"),
            ("X_Value", "drive", "place"),
            ("s", "V", "mm"),
        ),
        (lvm("No"), ("X_Value", "drive", "place"), ("s", "V", "mm")),
    ],
)
def test_names_and_units(
    tmp_path: Path, text: str, names: tuple[str, ...], units: tuple[str, ...]
) -> None:
    for encoding in ("utf-8", "latin-1", "utf-16"):
        found = table(tmp_path, text, encoding)
        assert holds(found, *names)
        said = [{"µm": "um"}.get(found.units[name], found.units[name]) for name in names]
        assert tuple(said) == tuple(units)


@pytest.mark.parametrize(
    "cells",
    [
        ("2024-02-29 23:59:59.5", "2024-03-01 00:00:00", "2024-03-01T00:00:00.5"),
        ("29.02.2024 23:59:59,5", "01.03.2024 00:00:00,0", "01.03.2024 00:00:00,5"),
        ("2/29/2024 11:59:59.5 PM", "3/1/2024 12:00:00 AM", "3/1/2024 12:00:00.5 AM"),
        ("23:59:59.5", "00:00:00.0", "00:00:00.5"),
    ],
)
def test_dates_and_times_are_seconds(tmp_path: Path, cells: tuple[str, ...]) -> None:
    rows = "".join(f"{cell};{u}\n" for cell, u in zip(cells, U, strict=True))
    found = table(tmp_path, "when;u\n" + rows)
    got = found.several(["when", "u"])
    np.testing.assert_allclose(np.diff(got["when"]), 0.5, atol=1e-9)
    assert got["u"].tolist() == U and found.units["when"] == "s"


@pytest.mark.parametrize("gap", MISSING)
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_a_missing_number_is_nan_wherever_it_stands(tmp_path: Path, mark: str, gap: str) -> None:
    rows = [("t", "u", "x"), (gap, "1", "2"), ("1", gap, "3"), ("2", "5", gap), ("3", "6", "4")]
    text = "\n".join(mark.join(row) for row in rows)
    found = table(tmp_path, f"{text}\n\n").several(["t", "u", "x"])
    nan = float("nan")
    expected = [[nan, 1.0, 2.0, 3.0], [1.0, nan, 5.0, 6.0], [2.0, 3.0, nan, 4.0]]
    np.testing.assert_array_equal(list(found.values()), expected)


def test_rows_of_other_lengths_are_left_out_even_if_they_compensate(tmp_path: Path) -> None:
    text = "t,u,x\n0,1.25,10\n0.2,7\n0.3,7,8,9\n0.5,-2.5,20.5\n1,3,30\n"
    text += "2,3,30\n3,3,30\n"
    with pytest.warns(UnreadLinesWarning, match="line 3: 2 cells instead of 3, and 1 more line"):
        assert list(table(tmp_path, text).columns["t"]) == [0.0, 0.5, 1.0, 2.0, 3.0]


def test_day_and_month_that_cannot_be_told_apart_are_refused(tmp_path: Path) -> None:
    found = table(tmp_path, "when,u\n01/02/2024 10:00,1\n02/03/2024 10:00,2\n")
    with pytest.raises(InputError, match="are ambiguous"):
        found.several(["when"])


@pytest.mark.parametrize(
    ("text", "wanted", "said"),
    [
        ("t,word\n0,one\n1,two\n2,three\n", "word", "line 2, word: 'one'"),
        ("t,u,u\n0,1,1\n1,2,2\n", "u", "'u' occurs twice"),
    ],
)
def test_what_is_wrong_is_said_by_line(tmp_path: Path, text: str, wanted: str, said: str) -> None:
    found = table(tmp_path, text)
    with pytest.raises(InputError) as caught:
        found.several([wanted])
    assert said in str(caught.value)


def test_without_a_heading_columns_have_numbers(tmp_path: Path) -> None:
    found = table(tmp_path, "0,1.25,10\n0.5,-2.5,20.5\n1,3,30\n")
    assert holds(found, "1", "2", "3") and "no heading" in found.note


def test_only_what_is_asked_for_is_parsed(tmp_path: Path) -> None:
    found = table(tmp_path, "t,u\n0,1\n1,2\nbroken,3\n")
    assert found.several(["u"])["u"].tolist() == [1.0, 2.0, 3.0]


@given(
    widths=st.lists(st.integers(1, 4), min_size=4, max_size=4),
    size=st.integers(1, 40),
    end=st.sampled_from(["\n", "\r\n", " \n", "\t \r\n"]),
)
def test_pieces_of_any_size_make_the_same_rows(
    tmp_path_factory: pytest.TempPathFactory, widths: list[int], size: int, end: str
) -> None:
    """Where a read ends, within blanks too, makes no difference."""
    a, b, c, d = (" " * w for w in widths)
    text = "t u x" + end + "".join(f"{a}{k}{b}{k + 0.5}{c}{-k}{d}{end}" for k in range(9))
    path = tmp_path_factory.mktemp("pieces") / "a.txt"
    path.write_bytes(text.encode())
    (layout,) = layouts(split(path.read_bytes(), True, "a"), "a")
    made = b"".join(pieces(path, layout, lambda _: None, size))
    assert [line.split(b" ") for line in made.splitlines()] == [
        f"{k} {k + 0.5} {-k}".encode().split() for k in range(9)
    ]


def test_a_line_with_a_return_in_it_is_one_line(tmp_path: Path) -> None:
    with pytest.warns(UnreadLinesWarning, match=r"line 3, u: 'x' is not a number"):
        table(tmp_path, "t,u\n0,1\n0.5\r,x\n1,3\n").several(["t", "u"])
