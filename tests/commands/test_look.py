"""`macromicro look`: what it sees in files that were made to show it, and how it goes on."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

from macromicro import cli
from macromicro.files.reading import read_table
from macromicro.files.recordings import recording
from macromicro.identify.kinds import drive
from macromicro.identify.picking import pick

RNG = np.random.default_rng(3)
N = 2000
T = 0.001 * np.arange(N)
U = np.sign(np.sin(20.0 * T)) + 0.01 * RNG.standard_normal(N)
X = np.cumsum(np.cumsum(U)) * 1e-6


def look(*words: str) -> int:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["macromicro", "look", *words])
        return cli.main()


def written(place: Path, **columns: object) -> str:
    path = place / "a.csv"
    rows = zip(*columns.values(), strict=True)  # type: ignore[call-overload]
    text = ",".join(columns) + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows)
    path.write_text(text)
    return str(path)


def seen(capsys: pytest.CaptureFixture[str], file: str) -> dict[str, object]:
    assert look(file, "--json") == 0
    return dict(json.loads(capsys.readouterr().out))


def remarks(found: dict[str, object]) -> dict[str, str]:
    columns = found["columns"]
    assert isinstance(columns, list)
    return {column["name"]: "; ".join(column["remarks"]) for column in columns}


def test_a_good_file_and_the_command_for_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path, t_s=T, u_V=U, x_mm=X, note=["warm"] * N)
    assert look(file) == 0
    said = capsys.readouterr().out
    assert "1000 Hz" in said and "in its name" in said and "text, or empty" in said
    assert said.splitlines()[-1] == f"macromicro identify drive {file}"
    assert "gaps" not in said and "saturated" not in said and "wraps" not in said


def test_identify_takes_the_columns_that_look_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A column of words is none of numbers, whatever it is called."""
    words = ["on" if k % 7 else "off" for k in range(N)]
    file = written(tmp_path, t_s=T, u=words, voltage_V=U, x_mm=X)
    assert look(file) == 0
    said = capsys.readouterr().out
    assert "u: voltage_V, by its name" in said
    assert said.splitlines()[-1] == f"macromicro identify drive {file}"
    picked = pick(read_table(Path(file)), drive.ROLES, {})
    assert picked.names == {"t": "t_s", "u": "voltage_V", "x": "x_mm"}
    assert picked.units == {"t": "s", "u": "V", "x": "m"}


def test_faults_of_times(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = T.copy()
    t[1200:] += 0.5
    t[300], t[700] = t[299], t[698]
    found = seen(capsys, written(tmp_path, t_s=t, u_V=U, x_mm=X))
    timing = found["timing"]
    assert isinstance(timing, dict)
    assert [timing[k] for k in ("gaps", "twice", "falls")] == [1, 1, 1]
    assert [timing[f"first_{k}"] for k in ("gap", "twice", "fall")] == [1201, 301, 701]
    assert timing["rate"] == pytest.approx(1000.0) and timing["longest"] == pytest.approx(0.501)


def test_times_that_begin_anew_with_each_run_are_no_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path, t_s=T % 0.5, u_V=U, x_mm=X, run=np.floor(T / 0.5 + 1e-9))
    found = seen(capsys, file)
    timing = found["timing"]
    assert isinstance(timing, dict)
    assert [timing[k] for k in ("gaps", "twice", "falls", "runs")] == [0, 0, 0, 4]
    assert timing["duration"] == pytest.approx(4 * 0.499) and remarks(found)["t_s"] == ""
    assert look(file) == 0 and "4 runs" in capsys.readouterr().out


def test_wraps_saturation_and_gaps_in_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    count = np.arange(0, 40 * N, 40) % 4096
    swing = np.clip(np.sin(9.0 * T) + 1e-3 * RNG.standard_normal(N), -1.0, 0.8)
    holes = [("" if k == 7 else v) for k, v in enumerate(X)]
    file = written(
        tmp_path, t=T, square=np.sign(U), count=count, swing=swing, x_mm=holes, zero=0 * T
    )
    said = remarks(seen(capsys, file))
    assert said["count"] == "wraps 19 times at 4096, first in row 104"
    assert "stay at 0.8" in said["swing"] and "saturated" in said["swing"]
    assert said["square"] == "" and said["zero"] == "constant"
    assert look(file) == 0 and "1 rows without a number" in capsys.readouterr().out


def test_what_is_not_certain_is_left_to_the_user(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No command, but one to complete."""
    file = written(tmp_path, a=X, b=U, c=T)
    found = seen(capsys, file)
    assert found["command"] == ""
    assert shlex.split(str(found["template"]))[-1] == "t=c,u=?,x=?"
    assert look(file) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("to complete: macromicro identify")


def test_roles_by_units_where_names_say_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = seen(capsys, written(tmp_path, **{"Zeit [s]": T, "Spannung [V]": U, "Weg [um]": X}))
    assert shlex.split(str(found["command"]))[-1] == "t=Zeit [s],u=Spannung [V],x=Weg [um]"
    speed = seen(capsys, written(tmp_path, **{"t": T, "i [A]": U, "tacho [mm/s]": X}))
    assert shlex.split(str(speed["command"]))[-1] == "t=t,u=i [A],v=tacho [mm/s]"
    two = seen(capsys, written(tmp_path, **{"time": T, "a [V]": U, "b [V]": U, "Weg [um]": X}))
    assert shlex.split(str(two["template"]))[-1] == "t=time,u=?,x=Weg [um]"
    assert two["command"] == ""


def test_times_are_told_by_name_as_roles_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """T is a temperature; a column of dates is the time, whatever it is called."""
    found = seen(capsys, written(tmp_path, T=20.0 + X, t=T, u_V=U))
    assert found["time"] == "t" and found["timing"]["rate"] == pytest.approx(1000.0)  # type: ignore[index]
    dates = [f"2026-03-01 12:{k // 60:02d}:{k % 60:02d}" for k in range(N)]
    found = seen(capsys, written(tmp_path, stamp=dates, u_V=U, x_mm=X))
    assert str(found["command"]).startswith("macromicro identify drive ") and "?" not in str(found)


def test_a_column_that_cannot_be_read_says_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = [("oops" if k == 8 else v) for k, v in enumerate(X)]
    file = written(tmp_path, t=T, u=U, x=bad)
    assert look(str(file)) == 0
    assert "line 10, x: 'oops' is not a number" in capsys.readouterr().err
    columns = seen(capsys, file)["columns"]
    assert isinstance(columns, list)
    assert [column["missing"] for column in columns] == [0, 0, 1]


def test_reversal_curves_and_what_is_no_data(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    forc = Path(__file__).parents[2] / "examples/data/forc/hchb_forc"
    assert look(str(forc)) == 0
    assert "identify hysteresis" in capsys.readouterr().out
    (tmp_path / "a.txt").write_text("only words\nand more of them\n")
    assert look(str(tmp_path / "a.txt")) == 2
    assert "rows of numbers" in capsys.readouterr().err


def test_measured_data_as_a_recording(tmp_path: Path) -> None:
    """Names become a recording's, times s; words are left out, and what nobody asked for."""
    rows = "".join(
        f"{1000 * t},{x},{k % 3},warm\n" for k, (t, x) in enumerate(zip(T, X, strict=True))
    )
    (tmp_path / "a.csv").write_text("time [ms],Place 1 [mm],2nd,note\n" + rows)
    found = recording(tmp_path / "a.csv")
    assert [c.name for c in found.columns] == ["t", "Place_1", "column_2nd"]
    assert found.unit("Place_1") == "mm" and found.dt == pytest.approx(1e-3)
    np.testing.assert_allclose(found["t"], T, atol=1e-12)
    few = recording(tmp_path / "a.csv", ["Place_1"])
    assert [c.name for c in few.columns] == ["t", "Place_1"]
    np.testing.assert_allclose(few["Place_1"], X, rtol=1e-12)
