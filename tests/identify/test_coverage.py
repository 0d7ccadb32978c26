"""Coverage factors (JCGM 100:2008, 2.3.6; JCGM 101:2008, 7.7)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.identify import coverage


def test_normal_errors_have_the_factors_of_all() -> None:
    assert coverage.normal(3).tolist() == [[1.0] * 3, [1.96] * 3]


def test_errors_of_what_follows() -> None:
    spread = np.array([[4.0, 1.0, np.nan], [1.0, 9.0, np.nan], [np.nan, np.nan, np.nan]])
    slopes = np.array([[1.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    found = coverage.errors(spread, slopes)
    assert found[:2] == pytest.approx([2.0, math.sqrt(16.0 - 4.0 + 9.0)])
    assert math.isnan(found[2]) and found[3] == 0.0


@pytest.mark.parametrize(
    ("factor", "normal"), [(1.96, True), (1.8, True), (1.7, False), (2.3, False), (math.nan, True)]
)
def test_an_interval_is_told_where_it_is_not_twice_the_error(factor: float, normal: bool) -> None:
    assert coverage.is_normal(factor) is normal
