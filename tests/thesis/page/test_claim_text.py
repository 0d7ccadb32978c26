"""Numbers of claims in words."""

from __future__ import annotations

import pytest

from macromicro.thesis.claims import REPRODUCED, Claim
from macromicro.thesis.page import claim_text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2800.0, "2800"),
        (0.0, "0"),
        (-0.0, "0"),
        (83.2215210625849, "83.222"),
        (-0.01062, "-0.01062"),
        (123456.7, "123457"),
        (100000.4, "100000"),
        (1.2345678e9, "1.2346e9"),
        (2.5e-7, "2.5e-7"),
        (float("nan"), "-"),
        (float("inf"), "-"),
        ("SS94B1", "SS94B1"),
    ],
)
def test_five_digits_and_no_needless_exponent(value: float | str, text: str) -> None:
    assert claim_text.number(value) == text


def test_lists_are_shortened_openly() -> None:
    assert claim_text.numbers([1.0, 2.5]) == "1, 2.5"
    assert claim_text.numbers([1.0, 2.0, 3.0], 2) == "1, 2 and 1 more"
    assert claim_text.numbers(None) == "-"
    assert claim_text.numbers([]) == ""


def test_printed_words_stand_where_no_number_is() -> None:
    claim = Claim("A", "1", "c", None, 1.0, "s", REPRODUCED, printed_text="about a second")
    assert claim_text.printed_text(claim) == "about a second"
    assert claim_text.printed_text(claim._replace(printed=1.0)) == "1"
    assert claim_text.printed_text(claim._replace(printed_text="")) == "-"


def test_units_of_several_quantities_stand_in_brackets() -> None:
    assert claim_text.with_unit("1.5", "V") == "1.5 V"
    assert claim_text.with_unit("20, 2", "um, s") == "20, 2 (um, s)"
    assert claim_text.with_unit("-", "V") == "-"
    assert claim_text.with_unit("3", "") == "3"
