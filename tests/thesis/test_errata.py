"""The errata: every entry proves itself, and the recomputed numbers are these."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import LEVELS, TIMES, micro_steps
from macromicro.settings import Settings
from macromicro.thesis.chapter5.micro_runs import error_after
from macromicro.thesis.errata import ERRATA, Erratum, evidence

BY_NUMBER = {e.number: e for e in ERRATA}


def test_numbered_without_a_gap() -> None:
    assert [e.number for e in ERRATA] == list(range(1, len(ERRATA) + 1))
    assert len(ERRATA) >= 46


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
        (1, 2, 2.0, 1e-9),
        (2, 2, 42.56, 0.01),
        (2, 3, 0.1353, 5e-5),
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
        (26, 3, 200.0, 1e-9),
        (29, 1, 108.4, 0.05),
        (31, 0, 82.581682, 1e-6),
        (31, 1, 90.37, 0.005),
        (34, 1, 4.0, 0.0),
        (35, 0, 1.98, 0.005),
        (40, 0, 255.0, 0.0),
        (41, 0, 1.5, 1e-9),
        (42, 0, 9.96, 0.01),
        (42, 1, 1.96, 0.005),
        (44, 0, 0.976, 1e-9),
        (44, 1, 1.952, 1e-9),
        (44, 2, 2.0, 1e-9),
        (44, 3, 2.5, 1e-9),
        (44, 4, 10160.0, 1e-6),
        (45, 0, 0.3906, 5e-5),
        (45, 1, 0.1953, 5e-5),
        (46, 1, -2.1, 1e-9),
        (46, 2, 0.444, 0.0005),
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


def test_formulas_are_no_quotations() -> None:
    """A formula is written down anew, so it stands in no quotation marks."""
    for entry in ERRATA:
        lines = evidence(entry)
        for quote, line in zip(entry.quotes, lines, strict=False):
            assert ("“" in line) == (not quote.formula)
    formulas = [q for e in ERRATA for q in e.quotes if q.formula]
    assert len(formulas) >= 8


def test_the_derivative_time_removes_the_overshoot() -> None:
    """Erratum 43: without it a fifth of the frequency leaves most of the overshoot."""
    recompute = BY_NUMBER[43].recompute
    assert recompute is not None
    bare_high, bare, bare_low, held_high, held = (f.value for f in recompute())
    assert min(bare_high, bare, bare_low) > 10.0 and max(held_high, held) < 0.5
    assert bare_low > 0.5 * bare_high


def test_equal_gains_of_2_25_are_slower_than_none() -> None:
    """Erratum 46, on the bench: a second after each step more is left than under PI alone."""
    settings = Settings()

    def left(law: str, **gains: float) -> list[float]:
        field = law.replace("-", "_")
        changed = getattr(settings.controller, field)._replace(**gains)
        controller = settings.controller._replace(micro_law=law, **{field: changed})
        job = settings._replace(controller=controller)
        seen = on_twin(micro_steps(LEVELS, 2.0, TIMES), job, 0, False)
        return [abs(error_after(seen, time)) for time in TIMES]

    plain, held = left("pi", ki=2250.0), left("pi-antiwindup", ki=2250.0, kaw=2.25)
    assert all(h > 1.5 * p for h, p in zip(held, plain, strict=True))


def test_the_page_of_errata_is_made_from_the_list() -> None:
    """`make docs` brings it up to date."""
    place = Path(__file__).parents[2] / "docs" / "make_errata.py"
    spec = importlib.util.spec_from_file_location("make_errata", place)
    assert spec is not None and spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    assert maker.PAGE.read_text(encoding="utf-8") == maker.page()
