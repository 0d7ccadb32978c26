"""The list of claims, and what its kinds rest on."""

from __future__ import annotations

import math
import re
from decimal import Decimal

import pytest

from macromicro.settings import Settings
from macromicro.thesis.claims import (
    CALIBRATED,
    DIFFERS,
    KINDS,
    NOT_MEASURED,
    PREDICTED,
    REPRODUCED,
    SET,
    STATEMENTS,
    Claim,
    in_order,
    state,
    unmeasured,
)
from macromicro.thesis.page._free_parameters import free_parameters

# The D/A board latches a voltage one period late: structure of the bench, not a parameter.
# M7 follows from M2 and M3b, whose speeds were chosen; for I7 a gain of the controller was. M9,
# M14 and A4 had to be met from the first sketch on, by parameters that nothing records.
WITHOUT_PARAMETER = {"M10", "M7", "I7", "M9", "M14", "A4"}


def named() -> set[str]:
    """Claims that a parameter was calibrated to; "S5" stands for S5a and S5b."""
    found = set()
    for name in {n for p in free_parameters(Settings()) for n in p.claims}:
        parts = [s for s in STATEMENTS if re.fullmatch(f"{name}[a-z]", s)]
        found |= {name} if name in STATEMENTS else set(parts)
        assert name in STATEMENTS or parts, name
    return found


def test_calibrated_is_what_a_parameter_was_chosen_for() -> None:
    calibrated = {s.id for s in STATEMENTS.values() if s.kind == CALIBRATED}
    assert calibrated - named() == WITHOUT_PARAMETER
    by_setting = {s.id for s in STATEMENTS.values() if s.kind == SET}
    assert by_setting == {"M16", "I1"}
    assert named() - calibrated - by_setting == set()


def test_predicted_is_what_nothing_was_chosen_for() -> None:
    """By the history of the parameter files and of the figures that were to be met."""
    predicted = {s.id for s in STATEMENTS.values() if s.kind == PREDICTED}
    assert predicted == {"M8", "M12", "M13", "M15", "S12", "I6", "A5", "A6"}


def test_every_statement_is_whole() -> None:
    for name, s in STATEMENTS.items():
        assert s.id == name
        assert s.section and s.claim
        assert s.kind in KINDS
        assert s.printed is not None or s.printed_text
        assert s.accept or s.rule, "what counts as reproduced"
        assert all(low <= high for low, high in s.accept)
        several = len(s.accept) > 1 and isinstance(s.printed, list) and not s.of
        assert not several or len(s.accept) == len(s.printed)


def half_a_digit(printed: float) -> float:
    """Half a unit of the last digit of a printed number; a whole one is printed to 1."""
    exponent = Decimal(repr(printed)).normalize().as_tuple().exponent
    assert isinstance(exponent, int)
    return 0.5 * 10.0 ** min(exponent, 0)


def as_printed(s: Claim) -> bool:
    """Is what counts as reproduced the printed number, to its last digit or more narrowly?"""
    numbers = s.printed if isinstance(s.printed, list) else [s.printed]
    if s.of or len(numbers) != len(s.accept) or not all(isinstance(n, float) for n in numbers):
        return False
    pairs = zip(map(float, numbers), s.accept, strict=True)  # type: ignore[arg-type]
    room = 1.0 + 1e-9
    return all(
        low <= n <= high and max(high - n, n - low) <= half_a_digit(n) * room
        for n, (low, high) in pairs
    )


@pytest.mark.parametrize(("number", "half"), [(0.7, 0.05), (1.301, 5e-4), (2800.0, 0.5)])
def test_a_printed_number_is_as_exact_as_its_last_digit(number: float, half: float) -> None:
    assert half_a_digit(number) == pytest.approx(half)


@pytest.mark.parametrize("name", STATEMENTS)
def test_a_band_that_is_not_the_printed_number_says_why(name: str) -> None:
    """Wider than the number is printed, without it, of another quantity or of words; and a printed
    number that nothing is judged by."""
    s = STATEMENTS[name]
    in_words = not s.accept and not isinstance(s.printed, float)
    assert in_words or as_printed(s) or len(s.basis) > 5, "what the band rests on"


def test_a_band_without_the_printed_number_names_it() -> None:
    """S4 alone: a threshold that has to be passed."""
    outside = [
        s
        for s in STATEMENTS.values()
        if isinstance(s.printed, float)
        and s.accept
        and not s.of
        and not s.accept[0][0] <= s.printed <= s.accept[0][1]
    ]
    assert [s.id for s in outside] == ["S4"]
    assert "1.3 V itself" in outside[0].basis
    lists = [s for s in STATEMENTS.values() if isinstance(s.printed, list) and not s.of]
    for s in lists:
        for n, (low, high) in zip(s.printed or [], s.accept, strict=bool(s.accept)):
            assert math.isfinite(float(n)) and low <= float(n) <= high, s.id


def test_measured_or_not_the_words_are_the_same() -> None:
    good, gone = state("M1", 3.0, REPRODUCED, spread=0.25), unmeasured("M1", "it failed")
    assert good == Claim(*gone)._replace(measured=3.0, verdict=REPRODUCED, reason=good.reason)
    assert "differs by up to 0.25 V between" in good.reason
    assert gone.measured is None
    assert (gone.verdict, gone.printed, gone.unit) == (NOT_MEASURED, 3.0, "V")


def test_a_claim_that_is_not_listed() -> None:
    with pytest.raises(KeyError):
        state("Z9", 1.0, REPRODUCED)


def test_a_reason_takes_exactly_its_values() -> None:
    with pytest.raises(KeyError, match="spread"):
        state("M1", 3.0, REPRODUCED)
    with pytest.raises(KeyError, match="no placeholder for: place, width"):
        state("M1", 3.0, REPRODUCED, spread=0.25, width=1.0, place=2.0)
    late = state("M14", 0.7, DIFFERS, wording="late", travel=2800.0, seconds=6.0)
    assert late.reason == "not within 2 % of 2800 counts after 6 s"
    with pytest.raises(KeyError, match="early"):
        state("M14", 0.7, DIFFERS, wording="early", travel=2800.0, seconds=6.0)


def test_an_unknown_claim_is_lost_without_words() -> None:
    assert unmeasured("Z9", "it failed").verdict == NOT_MEASURED


def test_order_of_the_list() -> None:
    names = ["A1", "M3b", "Z9", "D10", "M3", "D9", "S13a", "I7"]
    claims = [unmeasured(name, "") for name in names]
    assert [c.id for c in in_order(claims)] == ["D9", "D10", "M3", "M3b", "S13a", "I7", "A1", "Z9"]
