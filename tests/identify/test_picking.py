"""Columns by role out of tables made by hand, and saturation of signals made by hand."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.files.naming import DATES, split_unit
from macromicro.files.table import Table
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.picking import Role, T, find_saturated, pick

X = Role("x", "position", ("x", "position"), ("m",))
U = Role("u", "voltage", ("u",), ("V",), optional=True)


def table(**columns: list[float]) -> Table:
    made = {name: np.array(values) for name, values in columns.items()}
    return Table("a.csv", made, {name: split_unit(name)[1] for name in made}, {})


def test_columns_of_two_lengths_are_refused() -> None:
    with pytest.raises(InputError, match=r"'x': 2, 'u': 3.*columns of one length"):
        pick(table(x_m=[1.0, 2.0], u_V=[1.0, 2.0, 3.0]), (X, U), {})


def test_a_name_with_a_colon_is_a_name_first() -> None:
    """ "a:mm" is the column of this name where there is one, else column a in mm."""
    both = Table(
        "a.mat", {"a:mm": np.array([7.0]), "a": np.array([5.0])}, {"a:mm": "m", "a": ""}, {}
    )
    assert pick(both, (X,), {"x": "a:mm"}).values["x"].tolist() == [7.0]
    one = Table("a.mat", {"a": np.array([5.0])}, {"a": ""}, {})
    assert pick(one, (X,), {"x": "a:mm"}).values["x"] == pytest.approx([5e-3])


def test_a_unit_that_is_named_by_hand_counts_more_than_the_files() -> None:
    """With the whole name and without the unit in it; without one the file's counts."""
    file = table(pos_mm=[1.0, 2.0])
    for wanted, factor in (
        ("pos_mm:um", 1e-6), ("pos:um", 1e-6), ("pos_mm", 1e-3), ("pos", 1e-3),
    ):  # fmt: skip
        found = pick(file, (X,), {"x": wanted}).values["x"]
        np.testing.assert_allclose(found, [factor, 2.0 * factor])


def test_a_whole_name_is_taken_before_one_without_its_unit() -> None:
    whole = Role("x", "", ("x", "X"))
    assert pick(table(x_m=[1.0], X=[2.0]), (whole,), {}).names == {"x": "x_m"}
    assert pick(table(Place_m=[1.0], PLACE=[2.0]), (Role("x", "", ("place",)),), {}).names == {
        "x": "PLACE"
    }
    assert pick(table(x_m=[1.0], x_mm=[2.0]), (X,), {}).names == {"x": "x_m"}  # else the first
    order = Role("x", "", ("first", "second"))
    assert pick(table(second=[1.0], first=[2.0]), (order,), {}).names == {"x": "first"}


@pytest.mark.parametrize(("unit", "cold", "hot"), [("K", 273.15, 373.15), ("degF", 32.0, 212.0)])
def test_a_temperature_has_a_zero_of_its_own(unit: str, cold: float, hot: float) -> None:
    """Water freezes at 0 degC and boils at 100; a difference in K stays one."""
    heat = Role("T", "", ("temperature",), ("degC",))
    file = Table("a.csv", {"temperature": np.array([cold, hot])}, {"temperature": unit}, {})
    found = pick(file, (heat,), {})
    np.testing.assert_allclose(found.values["T"], [0.0, 100.0], atol=1e-12)
    assert found.units["T"] == "degC"
    if unit == "K":
        rise = pick(file, (heat._replace(units=("K",)),), {})
        assert rise.values["T"].tolist() == [cold, hot]


def test_dates_are_times_whatever_they_are_called() -> None:
    file = table(stamp=[0.0, 1.0], x_m=[1.0, 2.0])
    with pytest.raises(InputError, match="no column for t"):
        pick(file, (T, X), {})
    dated = file._replace(reasons={"stamp": DATES}, units={"stamp": "s", "x_m": "m"})
    assert pick(dated, (T, X), {}).names == {"t": "stamp", "x": "x_m"}
    clock = dated._replace(columns={**file.columns, "clock": file.columns["stamp"]})
    assert pick(clock._replace(units={**dated.units, "clock": "s"}), (T,), {}).names["t"] == "clock"


def test_names_of_one_letter_are_taken_as_they_are_written() -> None:
    """T is a temperature, t a time."""
    time, heat = Role("t", "", ("t", "time")), Role("T", "", ("temperature", "T"))
    assert pick(table(T=[1.0], t=[2.0]), (time, heat), {}).names == {"t": "t", "T": "T"}
    assert pick(table(Time=[1.0], Temperature=[2.0]), (time, heat), {}).names == {
        "t": "Time", "T": "Temperature",
    }  # fmt: skip
    with pytest.raises(InputError, match="no column for t"):
        pick(table(T=[1.0]), (time,), {})


def test_a_column_that_has_a_role_fills_no_other() -> None:
    first, second = Role("a", "", ("u", "v")), Role("b", "", ("v", "u"))
    assert pick(table(u=[1.0], v=[2.0]), (first, second), {}).names == {"a": "u", "b": "v"}
    assert pick(table(u=[1.0], v=[2.0]), (first, second), {"b": "u"}).names == {"a": "v", "b": "u"}
    with pytest.raises(InputError, match="no column for b"):
        pick(table(u=[1.0]), (first, second), {})
    assert pick(table(u=[1.0]), (first, second._replace(optional=True)), {}).names == {"a": "u"}
    # Whoever names a column for both means it.
    both = {"a": "u", "b": "u"}
    assert pick(table(u=[1.0]), (first, second), both).names == both


def test_an_optional_column_may_be_missing() -> None:
    assert list(pick(table(x_m=[1.0]), (X, U), {}).values) == ["x"]


def test_ambiguous_and_unknown_names_are_refused() -> None:
    for wanted in ("pos", "place"):
        with pytest.raises(InputError, match="one of its columns: pos_mm, pos_m"):
            pick(table(pos_mm=[1.0], pos_m=[2.0]), (X,), {"x": wanted})
    with pytest.raises(InputError, match="--columns: 'speed'; accepted: one of x, u"):
        pick(table(x_m=[1.0]), (X, U), {"speed": "x_m"})


def found_in(x: np.ndarray) -> bool:
    """Is it told as saturated? Nothing else may be warned of."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        where = find_saturated(x, "x")
    assert all(issubclass(w.category, SaturationWarning) for w in told)
    assert bool(told) == bool(where.any())
    return bool(told)


def test_a_square_wave_is_no_saturated_sensor() -> None:
    """It has no pace at all between its two levels."""
    assert not found_in(np.repeat([0.0, 1.0] * 10, 10))
    assert not found_in(np.full(100, 3.0))


def test_stays_away_that_are_too_short_tell_no_pace() -> None:
    assert not found_in(np.tile([*[0.0] * 6, 1.0, 2.5, 1.5], 20))


@pytest.mark.parametrize("backwards", [False, True])
def test_the_pace_is_that_of_the_second_step_beyond_the_rail(backwards: bool) -> None:
    """The first is cut by the rail, and the third is no longer at it."""
    away = np.cumsum([0.1, 1.0, 0.05, *[1.0] * 6])
    back = away[-1] - np.cumsum([*[1.0] * 6, 0.4])
    x = np.tile(np.r_[np.zeros(10), away, back], 10)
    assert found_in(x[::-1] if backwards else x)
    slow = np.tile(np.r_[np.zeros(10), np.cumsum([0.1, 0.2, *[1.0] * 8, 0.2])], 10)
    both = np.concatenate([slow, slow[::-1]])
    assert not found_in(both)


def swing(held: int, n: int = 3000) -> np.ndarray:
    """A triangle that rests at its top once, for `held` samples."""
    x = 50.0 - np.abs(np.arange(n) % 100 - 50.0) + 1e-3 * np.arange(n)
    top = n // 2
    return np.r_[x[:top], np.full(held, 200.0), x[top : n - held]]


@pytest.mark.parametrize(("held", "n", "said"), [(20, 3000, False), (40, 3000, True),
                                                 (4, 200, False), (6, 200, True)])  # fmt: skip
def test_a_rest_of_a_percent_and_of_five_samples_is_a_rail(held: int, n: int, said: bool) -> None:
    assert found_in(swing(held, n)) is said


def test_what_rests_elsewhere_too_is_no_sensor_at_its_rail() -> None:
    """Rests within the range of more than a tenth of those at its end."""
    x = swing(100)
    for rest, said in ((8, True), (15, False)):
        other = x.copy()
        other[500 : 500 + rest] = 25.0
        assert found_in(other) is said


def test_too_few_samples_tell_nothing() -> None:
    x = np.r_[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, np.full(6, 7.0), np.arange(6.0, 0.0, -1.0)]
    assert len(x) == 19 and not found_in(x)
    assert found_in(np.r_[x, 0.5])


def test_more_than_half_is_refused() -> None:
    away = np.r_[np.arange(1.0, 6.0), np.arange(4.0, 0.0, -1.0)]  # nine samples
    for held, refused in ((9, False), (10, True)):
        x = np.tile(np.r_[np.zeros(held), away], 20)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if refused:
                with pytest.raises(InputError, match="saturated in 200 of 380 samples"):
                    find_saturated(x, "x")
            else:
                assert find_saturated(x, "x").mean() == 0.5
