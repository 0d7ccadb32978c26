"""Files and columns of a command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.identify.kinds.seen import given, table

from macromicro.errors import InputError
from macromicro.identify import picking
from macromicro.identify.kinds import fit, from_files
from macromicro.identify.kinds.linear import ROLES
from macromicro.identify.picking import RUN, Role


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return table(tmp_path / "a.csv", "t_s,u_V,x_mm", [0, 1], [1, 2], [3, 4])


def test_an_argument_with_an_equals_sign_is_a_column_after_columns(file: Path) -> None:
    found = picking.picking(["u=volts", str(file)], ["t=time"])
    assert found == picking.Picking([file], {"t": "time", "u": "volts"})
    with pytest.raises(InputError, match=r"u=volts.*no such file"):
        picking.picking(["u=volts", str(file)], [])
    odd = file.rename(file.with_name("u=volts"))
    assert picking.picking([str(odd)], ["t=time"]) == picking.Picking([odd], {"t": "time"})


def test_none_too_many_or_a_missing_file_is_refused(file: Path) -> None:
    with pytest.raises(InputError, match=r"FILE: no file is given.*one or more to identify from"):
        picking.there([])
    assert picking.there([file] * 500) == [file] * 500
    with pytest.raises(InputError, match=r"501 files were given.*At most 500"):
        picking.there([file] * 501)
    with pytest.raises(InputError, match=r"gone\.csv: no such file"):
        picking.there([file, "gone.csv"])
    with pytest.raises(InputError, match="no such file"):
        picking.there(["a\0b"])
    with pytest.raises(InputError, match="no such file"):
        picking.there(["a" * 5000])


def test_units_of_all_files_agree(file: Path, tmp_path: Path) -> None:
    other = table(tmp_path / "b.csv", "t_s,u_V,x_um", [0, 1], [1, 2], [3, 4])
    assert [t.units["x"] for t in picking.load(given(file, file), ROLES)] == ["mm", "mm"]
    with pytest.raises(InputError, match=r"b\.csv: . is in um, in .*a\.csv in mm"):
        picking.load(given(file, other), ROLES)


def test_curves_of_a_magnetometer_are_no_columns(tmp_path: Path) -> None:
    place = tmp_path / "forc"
    place.write_text("MicroMag 2900/3900 Data File\n")
    with pytest.raises(
        InputError, match=r"forc: the file holds first-order reversal curves.*identify hyster"
    ):
        picking.load(given(place), ROLES)


def test_kinds_and_their_options_are_named_in_a_refusal(file: Path) -> None:
    with pytest.raises(
        InputError, match=r"kind: .no.*one of drive, carriage, linear, deadzone, hysteresis"
    ):
        from_files("no", file)
    with pytest.raises(InputError, match=r"linear, option: .gain.*method, order, start, width"):
        from_files("linear", file, gain=1.0)


def test_what_nobody_foresaw_in_the_data_is_bad_input(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from macromicro.identify.kinds import linear

    def broken(picking: object, options: object) -> None:
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr(linear, "identify", broken)
    with pytest.raises(
        InputError, match=r"a\.csv: the data cannot be fitted: by nothing.*identify\.md"
    ):
        fit("linear", given(file))


def test_a_file_may_lack_an_optional_column_that_another_has(tmp_path: Path) -> None:
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    one.write_text("t_s,u_V,run\n0,1,0\n1,2,0\n")
    other.write_text("t_s,u_mV\n0,1\n1,2\n")
    roles = (Role("t", "time", ("t",), ("s",)), Role("u", "input", ("u",), ("V",)), RUN)
    first, second = picking.load(picking.Picking([one, other], {}), roles)
    assert "run" in first.values and "run" not in second.values
    other.write_text("t_s,u_N\n0,1\n1,2\n")
    roles = (roles[0], Role("u", "input", ("u",), ("V", "N")), RUN)
    with pytest.raises(InputError, match=r"other\.csv: u is in N, in .*one\.csv"):
        picking.load(picking.Picking([one, other], {}), roles)
