"""Text with units: exact values, nothing evaluated, nothing passes as something else."""

import math
from contextlib import suppress

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from macromicro import units
from macromicro.errors import InputError
from macromicro.units import (
    MAX_TEXT,
    alike,
    convert,
    measured,
    printed,
    quantity,
    quotient,
    remedy,
    shown,
)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("4 mm", "m", 0.004),
        ("1500 um", "m", 0.0015),
        ("5 um", "m", 5e-6),  # 5 * 1e-6 in floats is 4.9999999999999996e-06
        ("3 µm", "m", 3e-6),  # micro sign
        ("3 \u03bcm", "m", 3e-6),  # Greek mu
        ("1.5mm", "m", 0.0015),
        ("  -2.5e-3   m ", "m", -0.0025),
        ("+.5 m", "m", 0.5),
        ("1680 counts", "counts", 1680.0),
        ("1 count", "counts", 1.0),
        ("1700 counts/s", "counts/s", 1700.0),
        ("1700 counts/s/V", "counts/(s*V)", 1700.0),
        ("1250 mV/mm", "V/m", 1250.0),
        ("5 V/mm", "V/mm", 5.0),
        ("8 J/(kg K)", "J/kg/K", 8.0),
        ("6450 kg/m^3", "kg/m**3", 6450.0),
        ("10 gf/mm", "N/m", 98.0665),
        ("30 gf", "N", 0.2941995),
        ("6.5 MPa/K", "Pa/K", 6.5e6),
        ("20 degC", "degC", 20.0),
        ("20 °C", "degC", 20.0),
        ("14 K", "K", 14.0),
        ("2 h", "s", 7200.0),
        ("53 1/s", "1/s", 53.0),
        ("0.3", "", 0.3),
        ("0.3", "1", 0.3),
        ("30 %", "", 0.3),
        ("12 bits", "bits", 12.0),
        ("1 Hz", "rad/s", 2 * math.pi),  # not 1: Hz counts revolutions
        ("90 deg", "rad", math.pi / 2),
        ("2 V*s", "H*A", 2.0),
    ],
)
def test_value_is_the_float_nearest_to_the_text(text: str, unit: str, value: float) -> None:
    assert quantity(text, unit, "here") == value


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("4", "m"),  # no unit
        ("4 s", "m"),
        ("4 m^2", "m"),
        ("20 degC", "K"),  # a difference is not a temperature
        ("20 K", "degC"),
        ("3 rad", "counts"),
        ("3", "counts"),
        ("3 Hz", "1/s"),
        ("5 Vs", "V"),  # no plural s
        ("5 foo", ""),
        ("51/s", "1/s"),  # neither 51 1/s nor 5 1/s
        ("nan m", "m"),
        ("inf m", "m"),
        ("NaN", ""),
        ("1e999 m", "m"),
        ("1e9999999999 m", "m"),
        ("1e-400 m", "m"),  # too small for a float: would silently be zero
        ("1,5 mm", "m"),
        ("1_000 mm", "m"),
        ("\uff11 mm", "m"),  # a full-width digit
        ("", ""),
        ("", "m"),
        ("mm", "m"),
        ("__import__('os') m", "m"),
        ("2**9**9**9 m", "m"),
        ("9 m**9**9**9", "m"),
        ("1 m*(2**9)", "m"),
        ("1 " + "(m*" * 30, "m"),
        ("5 m/()", "m"),
        ("5 m)", "m"),
        ("5 m//s", "m/s"),
        ("5 m.__class__", "m"),
        ("x" * 500, "m"),
        ("1" * MAX_TEXT + " m", "m"),
    ],
)
def test_everything_else_is_refused_with_the_remedy(text: str, unit: str) -> None:
    with pytest.raises(InputError) as caught:
        quantity(text, unit, "file, key")
    assert str(caught.value).startswith("file, key")
    assert caught.value.accepted == remedy(unit)
    assert len(str(caught.value)) < 400


def test_remedy_names_the_units_that_would_do() -> None:
    assert remedy("m") == "a finite number and its unit: m, cm, mm, um or nm"
    assert "difference" in remedy("K")
    assert "plain number" in remedy("")
    assert alike("N") == ("N", "mN", "kN", "gf", "kgf")
    assert alike("N/m") == ("N/m",)


def test_measured_says_which_unit_fits() -> None:
    assert measured("120 mm", ("m", "counts"), "here") == (0.12, "m")
    assert measured("1680 counts", ("m", "counts"), "here") == (1680.0, "counts")
    with pytest.raises(InputError, match="m, cm, mm, um, nm or counts"):
        measured("5 s", ("m", "counts"), "here")


@pytest.mark.parametrize(
    ("value", "unit", "other", "text"),
    [
        (0.004, "m", "mm", "4 mm"),
        (3e-9, "m", "", "3e-9 m"),
        (2800.0, "counts", "", "2800 counts"),
        (75e9, "Pa", "GPa", "75 GPa"),
        (0.3, "", "%", "30 %"),
        (0.5, "", "", "0.5"),
        (-0.0, "m", "mm", "0 mm"),
        (math.nan, "m", "mm", "nan mm"),
        (math.pi, "rad", "deg", "180 deg"),
    ],
)
def test_shown_as_a_person_writes_it(value: float, unit: str, other: str, text: str) -> None:
    assert shown(value, unit, other) == text


def test_shown_with_few_digits() -> None:
    assert shown(200e-3 / 2800, "m", "mm", digits=4) == "0.07143 mm"


PAIRS = [("m", "mm"), ("N", "gf"), ("rad/s", "Hz"), ("", "%"), ("K/N", "K/gf"), ("counts", "")]


@given(
    st.floats(min_value=1e-200, max_value=1e200).flatmap(lambda x: st.sampled_from([x, -x])),
    st.sampled_from(PAIRS),
)
@example(1.311067941782078e-76, ("N", "gf"))  # its shortest decimal is not near enough
@settings(max_examples=100)
def test_what_is_shown_reads_back_to_the_same_float(value: float, pair: tuple[str, str]) -> None:
    assert quantity(shown(value, *pair), pair[0], "here") == value


@given(st.text(max_size=120), st.sampled_from(["m", "", "degC", "J/kg/K"]))
@settings(max_examples=100)
def test_any_text_is_a_finite_number_or_an_input_error(text: str, unit: str) -> None:
    with suppress(InputError):
        assert math.isfinite(quantity(text, unit, "here"))


@given(st.text(alphabet="0123456789.eE+-*/^() mskgKVA1°%", min_size=1, max_size=40))
@settings(max_examples=200)
def test_text_that_looks_like_a_quantity_never_fails_otherwise(text: str) -> None:
    with suppress(InputError):
        assert math.isfinite(quantity("1 " + text, "m", "here"))


def test_the_programs_own_mistakes_are_plain_errors() -> None:
    assert convert(120.0, "mm", "m") == 0.12
    with pytest.raises(ValueError, match="does not convert"):
        convert(1.0, "m", "s")
    with pytest.raises(ValueError, match="cannot be shown"):
        shown(1.0, "m", "s")
    with pytest.raises(ValueError, match="furlong"):
        shown(1.0, "furlong")


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("6 m/s kg", "m*kg/s", 6.0),  # a stroke binds the next factor alone
        ("6 m/(s kg)", "m/s/kg", 6.0),
        ("6 m/(s/kg)", "m*kg/s", 6.0),
        ("6 (m/s)/(kg/A)", "m*A/(s*kg)", 6.0),
        ("6 1/ms", "1/s", 6000.0),
        ("6 mm / ms^2", "m/s^2", 6000.0),
        ("6 mm^-1", "1/m", 6000.0),
        ("6 N*m", "J", 6.0),
        ("6 kN", "kg*m/s^2", 6000.0),
        ("6 T", "V*s/m^2", 6.0),
        ("60 rpm", "rad/s", 2 * math.pi),
    ],
)
def test_products_of_units(text: str, unit: str, value: float) -> None:
    assert quantity(text, unit, "here") == value


def test_every_unit_of_the_list_is_itself() -> None:
    for name in units._names():
        assert quantity(f"3 {name}", name, "here") == 3.0
        assert quantity(f"3 1/{name}", f"{name}^-1", "here") == 3.0


@pytest.mark.parametrize(
    ("above", "below", "found", "size"),
    [
        ("mm", "V", "mm/V", 1e-3),
        ("mm/s", "V", "mm/s/V", 1e-3),
        ("V", "mm/s", "V/(mm/s)", 1e3),
        ("N", "N*mm", "N/(N*mm)", 1e3),
        ("N", "1/ms", "N*ms", 1e-3),
        ("inch", "s", "inch/s", 0.0254),
        ("y", "V", "", None),
        ("m", "", "", None),
        ("m", "x", "", None),
        ("V", "V", "", None),
    ],
)
def test_a_quotient_of_units_is_one_or_none(
    above: str, below: str, found: str, size: float | None
) -> None:
    """What no unit is named for has none; a name of a column is no unit."""
    assert quotient(above, below) == found
    if size is not None:
        assert measured(f"1 {found}", (found,), "here") == (1.0, found)
        assert units.size(found) == pytest.approx(size, rel=1e-12)


def test_units_are_printed_with_spaces_and_powers() -> None:
    assert [printed(u) for u in ("V*s/m", "s**2", "1.059e-7 s^2")] == [
        "V s/m",
        "s^2",
        "1.059e-7 s^2",
    ]


@given(st.floats(1e-12, 1e6), st.sampled_from(["m", "s", "V", "N"]))
def test_a_readable_value_has_a_digit_before_its_point_if_a_unit_allows_it(
    value: float, unit: str
) -> None:
    scale, to = units.readable(-value, unit)
    assert scale == pytest.approx(units.convert(1.0, unit, to))
    assert scale * value >= 1.0 or to in ("nm", "us", "uV", "N")
    assert scale * value <= 1000.0 or to == unit  # rounding may reach it


def test_nothing_and_no_number_stay_in_their_unit() -> None:
    for value in (0.0, math.nan, math.inf):
        assert units.readable(value, "m") == (1.0, "m")
    assert units.readable(1e-9, "a word of a file's") == (1.0, "a word of a file's")
