"""The list of claims, and what its kinds rest on."""

from __future__ import annotations

import re

import pytest

from macromicro.settings import Settings
from macromicro.thesis.claims import (
    CALIBRATED,
    KINDS,
    NOT_MEASURED,
    PREDICTED,
    REPRODUCED,
    SET,
    STATEMENTS,
    Claim,
    in_order,
    lost,
    stated,
)
from macromicro.thesis.page.free_parameters import free_parameters

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


def test_measured_or_not_the_words_are_the_same() -> None:
    good, gone = stated("M1", 3.0, REPRODUCED, "why"), lost("M1", "it failed")
    assert good == Claim(*gone)._replace(measured=3.0, verdict=REPRODUCED, reason="why")
    assert gone.measured is None
    assert (gone.verdict, gone.printed, gone.unit) == (NOT_MEASURED, 3.0, "V")


def test_a_claim_that_is_not_listed() -> None:
    with pytest.raises(KeyError):
        stated("Z9", 1.0, REPRODUCED)
    assert lost("Z9", "it failed").verdict == NOT_MEASURED


def test_order_of_the_list() -> None:
    names = ["A1", "M3b", "Z9", "D10", "M3", "D9", "S13a", "I7"]
    claims = [lost(name, "") for name in names]
    assert [c.id for c in in_order(claims)] == ["D9", "D10", "M3", "M3b", "S13a", "I7", "A1", "Z9"]
