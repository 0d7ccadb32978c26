"""Every claim of the thesis, one test each: measured by its procedure, within what the
list accepts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from macromicro.thesis.claims import DIFFERS, REPRODUCED, STATEMENTS, accepts
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import as_rows

from .ended import PROCEDURES, ended, measured

# Reported as they are, with the numbers: see the reasons.
MISSED = {"D7", "S6", "S12", "A3"}
# What the measured numbers show of a rule beside the bands; the rest is in test_claim_rules.py and
# in the claims' own tests.
ALSO: dict[str, Callable[[Any], bool]] = {
    "D8": lambda m: set(m) == {"SS495A", "SS495A1", "SS495A2", "SS94B1", "90215"},
    "M7": lambda m: min(abs(m[0]), abs(m[2])) >= 4.0 * abs(m[1]),
    "M8": lambda m: len(m) == 6,
    "M15": lambda m: m[0] <= m[1] < m[2],
    "I1": lambda m: len(m) > 0,
    "A5": lambda m: m[1] > m[0] and m[3] > m[2] and m[2] > m[0],
}


def _each(text: str) -> list[str]:
    return text.split()


def test_sixty_claims_each_by_one_procedure() -> None:
    """In the order of the list: design, macro-stage, micro-stage, the whole, cycles."""
    listed = [name for p in PROCEDURES.values() for name in p.ids]
    assert len(STATEMENTS) == len(listed) == 60
    assert sorted(listed) == sorted(STATEMENTS)
    assert "".join(dict.fromkeys(name[0] for name in STATEMENTS)) == "DMSIA"
    assert {s.procedure for s in STATEMENTS.values()} <= set(PROCEDURES)


@pytest.mark.parametrize("name", STATEMENTS)
def test_claim(name: str) -> None:
    claim, listed = measured(name), STATEMENTS[name]
    assert claim.verdict == (DIFFERS if name in MISSED else REPRODUCED), claim.reason
    assert claim.measured is not None
    found = claim.measured if isinstance(claim.measured, list) else [claim.measured]
    if listed.accept and not listed.of:
        assert accepts(name, *map(float, found)) == (name not in MISSED), claim.measured
    if name in ALSO:
        assert ALSO[name](claim.measured), claim.measured
    if name in MISSED:
        assert claim.reason, "says why it differs"


@pytest.mark.parametrize("procedure", PROCEDURES.values(), ids=PROCEDURES)
def test_procedure_gives_what_it_declares(procedure: Procedure) -> None:
    result = ended(procedure.name)
    assert not result.failure and not result.notes, result.trace
    assert tuple(c.id for c in result.claims) == procedure.ids
    assert tuple(e.number for e in result.exhibits) == (*procedure.figures, *procedure.diagrams)
    shown = {name for e in result.exhibits for name in e.claims}
    assert shown >= set(procedure.ids), "each claim is seen in an exhibit"
    assert shown <= set(STATEMENTS)
    assert all(e.data and e.title and e.caption for e in result.exhibits)


def test_rows_are_plain_data() -> None:
    rows = as_rows([ended("laser-noise")])
    assert [r["id"] for r in rows] == ["I5", "I7"]
    wanted = {"id", "section", "claim", "printed", "measured", "unit", "verdict", "reason", "kind"}
    assert all(set(r) == wanted | {"accept", "of", "basis", "rule"} for r in rows)
    for row in rows:
        listed = STATEMENTS[row["id"]]
        assert row["accept"] == [list(ends) for ends in listed.accept]
        assert (row["basis"], row["rule"]) == (listed.basis, listed.rule)


# Every data figure and table of the thesis, by its number; drawings, photographs and the
# schematic stay out.
FIGURES = (
    *(f"2.{k}" for k in (8, 9, 10, *range(12, 20))),
    *_each("3.6 3.7 3.9"),
    *[
        "4.4",
        "4.8",
        "4.9",
        "4.11",
        "4.13",
        "4.14",
        "4.17",
        "4.18",
        "4.20",
        "4.22",
        "4.23",
        "4.24",
        "4.25",
    ],
    *[
        "5.5",
        "5.6",
        "5.7",
        "5.8",
        "5.9",
        "5.10",
        "5.11",
        "5.13",
        "5.14",
        "5.15",
        "5.16",
        "5.17",
        "5.19",
        "5.20",
        "5.22",
        "5.23",
    ],
    *_each("5.25 5.26 5.27 6.2 6.3 6.4 6.5 6.6"),
    *(f"D.{k}" for k in (5, 6, 7, *range(9, 15))),
    "A.1",
    *(f"Table {n}" for n in ("2.1", "3.1", "3.2", "6.1", "6.2", "C.1")),
)
DIAGRAMS = [
    "2.11",
    "3.1",
    "3.5",
    "D.2",
    "4.2",
    "4.3",
    "4.5",
    "4.6",
    "4.7",
    "4.10",
    "4.12",
    "4.15",
    "4.16",
    "4.19",
    "4.21",
    "5.1",
    "5.2",
    "5.4",
    "5.12",
    "5.18",
    "5.21",
    "5.24",
    "6.1",
]


def test_every_figure_has_its_counterpart() -> None:
    drawn = [n for p in PROCEDURES.values() for n in p.figures]
    diagrams = [n for p in PROCEDURES.values() for n in p.diagrams]
    assert set(FIGURES) <= set(drawn)
    assert sorted(diagrams) == sorted(DIAGRAMS)
    assert len(drawn + diagrams) == len(set(drawn + diagrams))
