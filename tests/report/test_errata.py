"""The errata: every entry proves itself, and the recomputed numbers are these."""

from __future__ import annotations

import pytest

from macromicro.report.errata import ERRATA, Erratum, evidence

BY_NUMBER = {e.number: e for e in ERRATA}


def test_numbered_without_a_gap() -> None:
    assert [e.number for e in ERRATA] == list(range(1, len(ERRATA) + 1))
    assert len(ERRATA) >= 27


@pytest.mark.parametrize("entry", ERRATA, ids=lambda e: str(e.number))
def test_entry_proves_itself(entry: Erratum) -> None:
    """A recomputed number, or both places that contradict each other, quoted briefly."""
    assert all((entry.place, entry.printed, entry.fault, entry.reading))
    assert entry.recompute or len(entry.quotes) >= 2
    assert all(0 < len(q.words) <= 90 and q.place for q in entry.quotes)
    assert len(evidence(entry)) >= 1


# Number, place among the figures, value worked out by hand, tolerance.
@pytest.mark.parametrize(
    ("number", "index", "value", "within"),
    [
        (1, 0, 0.0, 1e-9),
        (1, 1, -1.0, 1e-9),
        (2, 2, 42.56, 0.01),
        (3, 1, 0.5, 1e-9),
        (4, 0, 0.272, 1e-9),
        (4, 1, -1.0, 1e-9),
        (5, 0, 1700.0, 1.5),
        (5, 1, 3977.0, 0.5),
        (6, 0, 9.91, 0.01),
        (6, 1, 76.3, 0.05),
        (6, 2, 56.6, 0.05),
        (6, 3, 4.910, 0.001),
        (6, 4, 85.7, 0.05),
        (6, 5, 77.5, 0.05),
        (7, 0, 37.4, 0.05),
        (7, 1, 6.72, 0.01),
        (8, 0, -37.86, 1e-6),
        (9, 0, 1.0098, 5e-5),
        (11, 1, 239.0, 0.5),
        (11, 2, 1.469, 0.0005),
        (12, 2, 1.0, 0.01),
        (13, 0, -3.98, 1e-9),
        (14, 0, 0.589, 0.0005),
        (14, 1, 0.467, 0.0005),
        (15, 0, 183.7, 0.1),
        (15, 1, 186.7, 0.1),
        (15, 2, 122.0, 0.1),
        (15, 5, 800.0, 1e-9),
        (15, 6, 4.06, 0.005),
        (15, 7, 0.98, 0.005),
        (16, 0, 3000.0, 0.0),
        (16, 1, 4000.0, 0.0),
        (17, 0, 25.34, 1e-9),
        (18, 0, 71.4, 0.05),
        (19, 0, 5.0, 0.0),
        (22, 0, 0.1, 1e-9),
        (22, 1, 1 / 30, 1e-9),
        (25, 2, 5.64, 0.005),
        (26, 2, 0.833, 0.001),
        (26, 3, 1.0, 0.01),
        (26, 4, 200.0, 1e-9),
        (29, 1, 108.4, 0.05),
        (31, 0, 82.581682, 1e-6),
        (31, 1, 90.37, 0.005),
        (34, 1, 4.0, 0.0),
        (35, 0, 1.98, 0.005),
        (40, 0, 255.0, 0.0),
        (41, 0, 1.5, 1e-9),
    ],
)
def test_recomputed_number(number: int, index: int, value: float, within: float) -> None:
    recompute = BY_NUMBER[number].recompute
    assert recompute is not None
    assert recompute()[index].value == pytest.approx(value, abs=within)


def test_evidence_in_words() -> None:
    lines = evidence(BY_NUMBER[17])
    assert lines == ["83 - 57.66: 25.34 K (printed: 25.5 K)"]
    assert evidence(BY_NUMBER[10])[0].startswith("5.2.2: “the weighted nonlinear gain")
