"""A result's figures as text: as many digits as the error carries."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.identify.result import Line, Result, rounded


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (199.6, 15.0, ("200", "15")), (199.6, 1.53, ("199.6", "1.5")),
        (93.748, 2.4, ("93.7", "2.4")), (95.0123, 0.12, ("95.01", "0.12")),
        (2.5, 0.0996, ("2.50", "0.10")), (0.0, 0.3, ("0.00", "0.30")),
        (123456.0, 789.0, ("123460", "790")), (0.001234, 1.2e-5, ("0.001234", "0.000012")),
        (-0.95833, 3e-5, ("-0.958330", "0.000030")), (0.55, 10.0, ("0.6", "10")),
        (4e-8, 3e-10, ("4.000e-08", "3e-10")), (1e9, 2e7, ("1.000e+09", "2e+07")),
        (4.7e7, 1.1e13, ("5e+07", "1.1e+13")), (1e-3, 4e-9, ("1.0000000e-03", "4e-09")),
        (3.99999935, 5.9e-7, ("3.99999935", "5.9e-07")), (0.02, 4e-8, ("0.020000000", "4e-08")),
        (1.25, 1e-9, ("1.2500000000", "1e-09")), (1.25, 1e-10, ("1.2500000000e+00", "1e-10")),
        (1.25, math.nan, ("1.25", "")), (math.nan, 1.0, ("-", "")), (2.0, 0.0, ("2", "0")),
        (math.inf, 1.0, ("inf", "")),
    ],
)  # fmt: skip
def test_a_value_has_the_digits_of_its_error(
    value: float, error: float, text: tuple[str, str]
) -> None:
    assert rounded(value, error) == text


@given(st.floats(1e-4, 1e6), st.floats(1e-5, 1.0), st.booleans())
def test_what_is_printed_is_within_a_twentieth_of_the_error(
    value: float, part: float, negative: bool
) -> None:
    """Half a unit of its second digit, 10 at the least; the error itself likewise."""
    signed, error = -value if negative else value, part * value
    text, told = rounded(signed, error)
    assert abs(float(text) - signed) <= 0.0501 * error
    assert float(told) == pytest.approx(error, rel=0.0501)


def test_in_a_notebook_the_text_is_in_the_text(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where rich sees Jupyter it would show the table there, and leave `str` empty."""
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    found = Result("hall", "a table", None, [Line("width", 2.5, 0.1, "mm")], [], "", dict)
    assert "width" in str(found) and "2.50" in str(found) and "\x1b" not in str(found)


def test_half_of_an_interval_is_told_where_it_is_not_twice_the_error() -> None:
    lines = [
        Line("mass", 4.0, 0.1, "kg"),
        Line("phase", 2.0, 0.5, "rad", "of a cog", 1.41),
        Line("few", 3.0, 0.2, "m", factor=4.3),
        Line("none", 1.0),
    ]
    text = str(Result("drive", "a drive", None, lines, [], "", dict)).splitlines()
    assert text[1].split() == ["value", "+-", "95", "%", "+-", "unit"]
    assert text[2].split() == ["mass", "4.00", "0.10", "kg"]
    assert text[3].split() == ["phase", "2.00", "0.50", "0.70", "rad", "of", "a", "cog"]
    assert text[4].split() == ["few", "3.00", "0.20", "0.86", "m"]
    assert lines[1].half == pytest.approx(0.705)
    plain = str(Result("drive", "a drive", None, lines[::3], [], "", dict)).splitlines()
    assert plain[1].split() == ["value", "+-", "unit"]


def test_another_measure_of_accuracy_has_a_column_of_its_own() -> None:
    """It sets the digits of the value, and is no standard error."""
    lines = [
        Line("low", 2.03456, unit="V", extra=0.5, extra_name="step"),
        Line("slope", 1.0, 0.25),
        Line("high", 7.0, unit="V", extra=0.01, extra_name="misfit"),
    ]
    found = Result("deadzone", "a zone", None, lines, [], "", dict)
    text = str(found).splitlines()
    assert text[1].split() == ["value", "+-", "step", "misfit", "unit"]
    assert text[2].split() == ["low", "2.03", "0.50", "V"]
    assert text[4].split() == ["high", "7.000", "0.010", "V"]
    assert found.uncertainty == {"slope": 0.25}
    values = json.loads(found.to_json())["values"]
    assert (values[0]["error"], values[0]["extra"], values[0]["extra_name"]) == (None, 0.5, "step")
    assert (values[1]["extra"], values[1]["extra_name"]) == (None, "")
