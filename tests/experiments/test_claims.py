"""Every claim of the thesis, one test each: measured by its procedure, within what counts as
reproduced. The bounds stand here a second time, so that a verdict cannot be its own judge."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from ended import PROCEDURES, ended, measured

from macromicro.experiments.claim import DIFFERS, KINDS, REPRODUCED
from macromicro.experiments.procedure import Procedure
from macromicro.experiments.reproduce import as_rows
from macromicro.experiments.statements import STATEMENTS

# Reported as they are, with the numbers: see the reasons.
MISSED = {"D7", "S6", "S12"}


def _each(text: str) -> list[str]:
    return text.split()


Accept = Callable[[Any], bool]


def near(wanted: float, share: float) -> Accept:
    """Within a share of a figure."""
    return lambda m: abs(m / wanted - 1.0) <= share


def between(low: float, high: float) -> Accept:
    return lambda m: low <= m <= high


def each(*rules: Accept) -> Accept:
    """One rule for each number of a list."""
    return lambda m: len(m) == len(rules) and all(r(x) for r, x in zip(rules, m, strict=True))


ANY: Accept = math.isfinite

# What counts as reproduced, where the measured numbers alone can show it; for S6, which differs,
# what is measured. What else belongs to a rule is in test_claim_rules.py; the remaining claims'
# own tests hold them to theirs.
ACCEPT: dict[str, Accept] = {
    "D1": near(0.467, 0.005),
    "D2": near(1.22, 0.005),
    "D3": near(0.3904, 0.005),
    "D4": near(5.0, 0.02),
    "D5": near(1.952, 0.02),
    "D6": lambda m: 0.75 <= m / (5000.0 / 4096.0) <= 0.85,
    "D7": each(
        *(near(v, 0.02) for v in (460.0, 305.0, 144.0, 146.0, 167.0)), ANY, near(213.0, 0.02)
    ),
    "D8": lambda m: set(m) == {"SS495A", "SS495A1", "SS495A2", "SS94B1", "90215"},
    "D9": lambda m: m == 255.0,
    "D10": lambda m: m == [255.0, 1500.0, 4000.0, 4000.0, 8000.0],
    "D11": near(3.08, 0.01),
    "M1": between(2.85, 3.15),
    "M2": near(1700.0, 0.04),
    "M3": near(3977.0, 0.04),
    "M3b": near(6507.0, 0.06),
    "M4a": between(-0.96233, -0.95433),
    "M4b": near(165.72, 0.08),
    "M5": each(near(0.16572, 0.08), between(-1.96233, -1.95433), between(0.95433, 0.96233)),
    "M6a": between(0.334, 0.394),
    "M6b": between(0.606, 0.666),
    "M7": lambda m: min(abs(m[0]), abs(m[2])) >= 4.0 * abs(m[1]),
    "M8": lambda m: len(m) == 6 and max(m) < 10.0,
    "M9": between(0.45, 0.9),
    "M10": lambda m: m[0] >= 1.0 and m[1] >= 2.0,
    "M11": near(4.91, 0.005),
    "M11b": each(near(76.3, 0.005), near(9.91, 0.005)),
    "M12": each(between(0.0, 0.99), lambda m: m == 0.0, between(0.2, 2.0)),
    "M13": between(0.0, 5.0),
    "M14": between(0.6, 0.95),
    "M15": lambda m: m[0] <= m[1] < m[2],
    "M16": between(2798.0, 2802.0),
    "S1": lambda m: m[0] > 5.0 and m[1] < 0.5,
    "S2": between(0.0, 3.0),
    "S3": between(3.96, 4.0),
    "S4": lambda m: 1.3 < m < 1.5,
    "S5a": between(80.0, 86.0),
    "S5b": near(37.86, 0.3),
    "S6": between(109.0, 110.0),
    "S8": between(0.8, 1.3),
    "S9": each(*(between(v - 0.1, v + 0.1) for v in (57.67, 82.72, 93.45, 139.1))),
    "S10": lambda m: m[0] < 5.0 and m[1] >= 3.0,
    "S13a": between(0.3, 0.7),
    "S13b": between(0.7, 1.3),
    "S13c": between(0.0, 5.0),
    "I1": lambda m: len(m) > 0 and all(abs(x - 2.0) < 2e-3 for x in m),
    "I2": each(between(14.0, 26.0), between(1.5, 2.5)),
    "I3": lambda m: m[0] >= 25.0 and m[1] > 5.0,
    "I4": between(0.7, 1.3),
    "I5": between(1.5, 2.5),
    "I6": between(1.6, 2.4),
    "I7": between(0.0, 2.5),
    "A1": between(0.18, 0.30),
    "A2": between(0.14, 0.24),
    "A3": between(1.0, 1.45),
    "A4": lambda m: m > 0.0,
    "A5": lambda m: m[1] > m[0] and m[3] > m[2] and m[2] > m[0],
}
BY_PROCEDURE = {"S7", "S11", "S12", "A6"}
IDS = (
    *(f"D{k}" for k in range(1, 12)),
    *[
        "M1",
        "M2",
        "M3",
        "M3b",
        "M4a",
        "M4b",
        "M5",
        "M6a",
        "M6b",
        "M7",
        "M8",
        "M9",
        "M10",
        "M11",
        "M11b",
        "M12",
        "M13",
        "M14",
        "M15",
        "M16",
    ],
    *[
        "S1",
        "S2",
        "S3",
        "S4",
        "S5a",
        "S5b",
        "S6",
        "S7",
        "S8",
        "S9",
        "S10",
        "S11",
        "S12",
        "S13a",
        "S13b",
        "S13c",
    ],
    *(f"I{k}" for k in range(1, 8)),
    *(f"A{k}" for k in range(1, 7)),
)


def test_sixty_claims_each_by_one_procedure() -> None:
    listed = [name for p in PROCEDURES.values() for name in p.ids]
    assert len(IDS) == 60
    assert sorted(listed) == sorted(IDS)
    assert tuple(STATEMENTS) == IDS, "their order is that of the list"
    assert set(ACCEPT) | BY_PROCEDURE == set(IDS)


@pytest.mark.parametrize("name", IDS)
def test_claim(name: str) -> None:
    claim = measured(name)
    assert claim.verdict == (DIFFERS if name in MISSED else REPRODUCED), claim.reason
    assert claim.measured is not None
    assert claim.claim
    assert claim.section
    assert claim.kind in KINDS
    if name in ACCEPT:
        assert ACCEPT[name](claim.measured), claim.measured
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
    assert shown <= set(IDS)
    assert all(e.data and e.title and e.caption for e in result.exhibits)


def test_rows_are_plain_data() -> None:
    rows = as_rows([ended("laser-noise")])
    assert [r["id"] for r in rows] == ["I5", "I7"]
    wanted = {"id", "section", "claim", "printed", "measured", "unit", "verdict", "reason", "kind"}
    assert all(set(r) == wanted for r in rows)


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
