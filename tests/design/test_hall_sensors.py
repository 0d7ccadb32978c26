"""Choice of the Hall sensor, Table 3.2."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.design.hall_sensors import TABLE_3_2, Needs, Sensor, judge, suitable
from macromicro.errors import InputError


def test_five_sensors_are_suitable() -> None:
    """Claim D8."""
    names = {s.name for s in suitable(TABLE_3_2, Needs())}
    assert names == {"SS495A", "SS495A1", "SS495A2", "SS94B1", "90215"}


def test_cost_limit_of_section_3_2_3_excludes_the_programmable_one() -> None:
    names = [s.name for s in suitable(TABLE_3_2, Needs(cost=100.0))]
    assert names == ["SS495A", "SS495A1", "SS495A2", "SS94B1"]


def test_reasons_are_named() -> None:
    against = {v.sensor.name: v.against for v in judge(TABLE_3_2, Needs())}
    assert against["SS496A"] == ("2.5 mV/G, needs 3 mV/G",)
    assert len(against["SS94A1B"]) == 2
    assert against["SS94B1"] == ()


@given(st.floats(1.0, 2000.0), st.floats(1e-4, 2e-2))
def test_harder_needs_never_admit_more(field: float, sensitivity: float) -> None:
    easy = suitable(TABLE_3_2, Needs(field, sensitivity))
    hard = suitable(TABLE_3_2, Needs(1.1 * field, 1.1 * sensitivity))
    assert set(hard) <= set(easy)


@pytest.mark.parametrize(
    "needs", [Needs(field=0.0), Needs(sensitivity=float("nan")), Needs(cost=-1.0)]
)
def test_impossible_needs_are_refused(needs: Needs) -> None:
    with pytest.raises(InputError, match="Hall sensor"):
        judge(TABLE_3_2, needs)


@pytest.mark.parametrize(
    "sensor",
    [
        Sensor("x", -1.0, (1e-3, 1e-3), 1.0),
        Sensor("x", 1.0, (2e-3, 1e-3), 1.0),
        Sensor("x", 1.0, (0.0, 1e-3), 1.0),
        Sensor("x", 1.0, (1e-3, 1e-3), 0.0),
    ],
)
def test_impossible_sensors_are_refused(sensor: Sensor) -> None:
    with pytest.raises(InputError, match="Hall sensor x"):
        judge([sensor], Needs())


@pytest.mark.parametrize(
    ("sensor", "against"),
    [
        (Sensor("x", 650.0, (3e-3, 3e-3), 9.0), ("range 650 G, needs over 650 G",)),
        (Sensor("x", 650.1, (3e-3, 3e-3), 9.0), ()),
        (Sensor("x", 651.0, (1e-3, 2.9e-3), 9.0), ("2.9 mV/G, needs 3 mV/G",)),
        (Sensor("x", 651.0, (1e-3, 3e-3), 9.0), ()),
        (Sensor("x", None, (3e-3, 3e-3), 10.0), ("10 USD, needs below 10 USD",)),
        (Sensor("x", None, (3e-3, 3e-3), 9.99), ()),
    ],
)
def test_requirements_to_the_last_digit(sensor: Sensor, against: tuple[str, ...]) -> None:
    """The range must exceed the field, the sensitivity reach its floor, the cost stay below."""
    assert judge([sensor], Needs(cost=10.0))[0].against == against


def test_the_cheapest_comes_first() -> None:
    dear, cheap = (Sensor(n, 700.0, (4e-3, 4e-3), c) for n, c in (("a", 9.0), ("b", 2.0)))
    assert suitable([dear, cheap], Needs()) == [cheap, dear]
    assert suitable([dear._replace(cost=1e6)], Needs()) == [dear._replace(cost=1e6)]
