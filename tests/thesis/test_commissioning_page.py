"""What the page of both stages tells: intervals with what a model leaves out."""

from __future__ import annotations

import math

import pytest

from macromicro.thesis.commissioning_page import half_width


def line(name: str, value: float | None, error: float | None) -> dict[str, object]:
    return {"name": name, "value": value, "error": error, "unit": "", "note": ""}


def test_the_swing_is_less_sure_than_its_noise_says() -> None:
    told = half_width("carriage", line("frequency", 20.0, 2e-4))
    assert told == pytest.approx(1.96 * math.hypot(2e-4, 3e-3))
    decay = half_width("carriage", line("decay", 1.2, 1e-3))
    assert decay == pytest.approx(1.96 * math.hypot(1e-3, 3.6e-3))


def test_other_intervals_are_those_of_their_errors() -> None:
    assert half_width("carriage", line("share", 0.02, 1e-5)) == pytest.approx(1.96e-5)
    assert half_width("actuator", line("frequency", 20.0, 1e-3)) == pytest.approx(1.96e-3)
    assert math.isnan(half_width("carriage", line("push", 10.0, None)))
    assert math.isnan(half_width("carriage", line("frequency", None, 1.0)))
