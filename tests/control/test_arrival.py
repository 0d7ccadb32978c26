"""One meaning of arrival: within the tolerance for the dwell."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import arrival
from macromicro.control.arrival import Sequence

Q = Sequence(tolerance=2.0, dwell=0.2)


@pytest.mark.parametrize(
    ("error", "inside"),
    [(0.0, True), (2.0, True), (-2.0, True), (2.1, False), (-2.1, False), (math.nan, False)],
)
def test_the_tolerance_is_inclusive_and_a_missing_reading_is_outside(
    error: float, inside: bool
) -> None:
    assert arrival.within(Q, error) == inside
    assert (arrival.since(Q, error, math.nan, 5.0) == 5.0) == inside
    assert (arrival.since(Q, error, 3.0, 5.0) == 3.0) == inside
    assert math.isnan(arrival.since(Q, error, 3.0, 5.0)) != inside


def test_arrival_takes_the_dwell() -> None:
    assert not arrival.arrived(Q, 1.0, 1.199)
    assert arrival.arrived(Q, 1.0, 1.2 - 1e-12)  # the clock's rounding does not cost a period
    assert not arrival.arrived(Q, math.nan, 9.0)


@given(st.lists(st.sampled_from([0.0, 1.9, 2.5, math.nan]), min_size=1, max_size=400))
def test_it_has_arrived_when_every_sample_of_the_dwell_was_within(errors: list[float]) -> None:
    inside = math.nan
    for k, error in enumerate(errors):
        inside = arrival.since(Q, error, inside, k * 1e-3)
        last = errors[max(k - 200, 0) : k + 1]
        expected = len(last) == 201 and all(abs(e) <= 2.0 for e in last)
        assert arrival.arrived(Q, inside, k * 1e-3) == expected
