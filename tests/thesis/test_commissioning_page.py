"""What the page of both stages tells: intervals of what was found."""

from __future__ import annotations

import math

import pytest

from macromicro.thesis.commissioning_page import half_width


def line(value: float | None, error: float | None) -> dict[str, object]:
    return {"name": "share", "value": value, "error": error, "unit": "", "note": ""}


def test_an_interval_is_that_of_its_error() -> None:
    assert half_width(line(0.02, 1e-5)) == pytest.approx(1.96e-5, rel=1e-3)
    assert half_width(line(0.02, 1e-5) | {"freedom": None}) == pytest.approx(1.96e-5, rel=1e-3)
    assert half_width(line(0.02, 1e-5) | {"freedom": 5.0}) == pytest.approx(2.571e-5, rel=1e-3)
    assert math.isnan(half_width(line(10.0, None)))
    assert math.isnan(half_width(line(None, 1.0)))
