"""Files as people have them: clocks, cut lines, several tables, units of other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.files._text import UnreadLinesWarning
from macromicro.files.reading import read_table
from macromicro.identify import from_files
from macromicro.identify.look import look
from macromicro.identify.picking import MissingRowsWarning, UnitWarning
from macromicro.models.mass import Axis, simulate

DT = 0.005
TRUE = Axis(mass=0.05, viscous=0.4, coulomb=0.5)


def driven(n: int = 1600) -> np.ndarray:
    """Time, effort and position of an axis that slides both ways, with noise of 1e-5."""
    t = DT * np.arange(n)
    u = 2.0 * np.sign(np.sin(2.0 * np.pi * 0.7 * t)) + np.sin(2.0 * np.pi * 0.31 * t)
    x = simulate(TRUE, u, DT) + 1e-5 * np.random.default_rng(1).normal(size=n)
    return np.column_stack([t, u, x])


ROWS = driven()


def text(rows: np.ndarray, heading: str) -> str:
    lines = (",".join(f"{value:.9g}" for value in row) for row in rows)
    return f"{heading}\n" + "\n".join(lines) + "\n"


def identified(*files: Path, **options: object) -> dict[str, float]:
    found = from_files("drive", list(files), structure="coulomb", **options)
    return {line.name: line.value for line in found.lines}


def holds(found: dict[str, float]) -> bool:
    return found["mass"] == pytest.approx(0.05, rel=0.02) and found["coulomb"] == pytest.approx(
        0.5, rel=0.02
    )


def test_a_cut_last_line_and_a_bad_one_are_left_out(tmp_path: Path) -> None:
    lines = text(ROWS, "t_s,u_V,x_rad").splitlines()
    lines[700] = "3.495,1.2"
    lines[900] = "4.495,?,0.1"
    file = tmp_path / "a.csv"
    file.write_text("\n".join(lines)[:-12])
    with pytest.warns(UnreadLinesWarning) as caught, pytest.warns(MissingRowsWarning, match="1 of"):
        assert holds(identified(file))
    said = " ".join(str(one.message) for one in caught)
    assert "line 701: 2 cells instead of 3, and 1 more line; left out" in said
    assert "line 901, u_V: '?' is not a number" in said


def test_a_text_of_which_little_is_a_table_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("t_s,u_V\n" + "0,1\n" * 4 + "0,1,2\n" * 3)
    with pytest.raises(InputError, match="line 6: the heading and this line differ: 3 cells"):
        read_table(file).several(["u_V"])


def test_a_gap_makes_two_runs(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text(text(np.delete(ROWS, slice(800, 840), axis=0), "t_s,u_V,x_rad"))
    with pytest.warns(MissingRowsWarning, match=r"a gap of 0.205 s after 3.995 s \(row 800\)"):
        assert holds(identified(file))


def test_tables_one_after_the_other_are_runs(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text(text(ROWS, "t_s,u_V,x_rad") + "Table 2\n" + text(ROWS, "t_s,u_V,x_rad"))
    with pytest.warns(MissingRowsWarning, match=r"time restarts after 7.995 s \(row 1600\)"):
        assert holds(identified(file))


@pytest.mark.parametrize(
    "header", ["# Sampling frequency [Hz]: 200", "# rate: 0.2 kHz", "# f_sampling=200Hz"]
)
def test_a_rate_in_the_header_does_for_a_column_of_times(tmp_path: Path, header: str) -> None:
    file = tmp_path / "a.csv"
    file.write_text(f"{header}\n" + text(ROWS[:, 1:], "u_V,x_rad"))
    with pytest.warns(UnitWarning, match="no column of times; the 200 Hz of its header"):
        assert holds(identified(file))
    assert look(file).onward.command == f"macromicro identify drive {file}"


def test_a_rate_is_given_or_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text(text(ROWS[:, 1:], "u_V,x_rad"))
    with pytest.raises(InputError, match="rows per second with --rate HZ"):
        identified(file)
    assert holds(identified(file, columns={"t": "200 Hz"}))
    file.write_text(text(ROWS[:, 1:], "1,2").partition("\n")[2])
    found = look(file).onward
    assert found.template.endswith("--rate HZ --columns 'u=?,x=?'") and not found.command
    assert "t: no column holds times; put the rows per second for HZ" in found.reasons


def test_one_odd_step_hides_no_clock(tmp_path: Path) -> None:
    rows = ROWS.copy()
    rows[700:, 0] += 0.0043
    file = tmp_path / "a.dat"
    file.write_text(text(rows, "").lstrip())
    assert "t: 1, which rises in even steps but for row 701" in look(file).onward.reasons


@pytest.mark.parametrize(
    ("heading", "per", "units"),
    [
        ("t_s,torque [Nm],angle_rad", 1.0, ("N*m", "kg*m^2")),
        ("t_s,torque [mNm],angle_rad", 1e3, ("N*m", "kg*m^2")),
        ("t_s,torque [kg*cm],angle_rad", 1.0 / 0.0980665, ("N*m", "kg*m^2")),
        ("t_s,torque [oz-in],angle_rad", 1.0 / 0.00706155, ("N*m", "kg*m^2")),
    ],
)
def test_torques_in_usual_spellings(
    tmp_path: Path, heading: str, per: float, units: tuple[str, str]
) -> None:
    file = tmp_path / "a.csv"
    file.write_text(text(ROWS * [1.0, per, 1.0], heading))
    found = from_files("drive", file, structure="coulomb")
    lines = {line.name: line for line in found.lines}
    assert (lines["coulomb"].unit, lines["mass"].unit) == units
    assert lines["coulomb"].value == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize("unit", ["rotations", "rot", "turns", "revolutions", "rev"])
def test_positions_in_rotations(tmp_path: Path, unit: str) -> None:
    file = tmp_path / "a.csv"
    file.write_text(text(ROWS / [1.0, 1.0, 2.0 * np.pi], f"t_s,u_V,position [{unit}]"))
    assert holds(identified(file))


def test_a_least_position_is_no_time(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("t_min,x_min,x_h\n0,1,2\n1,2,3\n")
    table = read_table(file)
    assert (table.units["t_min"], table.units["x_min"], table.units["x_h"]) == ("min", "", "")


def test_offsets_of_time_zones_count(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    stamps = ("2024-03-31T01:59:59+01:00", "2024-03-31T03:00:00+02:00", "2024-03-31T01:00:01Z")
    file.write_text("when,u_V\n" + "".join(f"{stamp},1\n" for stamp in stamps))
    assert np.diff(read_table(file).several(["when"])["when"]) == pytest.approx([1.0, 1.0])
