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
