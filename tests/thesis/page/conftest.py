"""A short reproduction, shared by the tests of its page."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from macromicro.drawing.exhibit import render
from macromicro.thesis import all_procedures, diagrams, reproduce
from macromicro.thesis.claims import CALIBRATED, DIFFERS, REPRODUCED, Claim
from macromicro.thesis.procedure import Lab, Procedure
from macromicro.thesis.reproduce import Result


class Reproduced(NamedTuple):
    """Results of some procedures, and the procedures that they belong to."""

    results: list[Result]
    procedures: list[Procedure]


HOSTILE = "</p><script>document.title = 'gone'</script><b>"
# A diagram twice, so that its ids would clash, and a claim that nothing shows.
_MADE = [
    Claim("X1", "9.1", HOSTILE, 1.0, [1.5, float("nan")], "m, s", DIFFERS, HOSTILE),
    Claim("X2", "9.1", "shown by two", None, 2.0, "%", REPRODUCED, "", CALIBRATED, "in words"),
]


@pytest.fixture(scope="session")
def reproduced() -> Reproduced:
    """Quick procedures, one made up of diagrams and hostile text, and one that failed."""
    quick = ("sensor-design", "technologies", "hall-calibration")
    procedures = [p for p in all_procedures() if p.name in quick]
    assert len(procedures) == len(quick)
    results = [reproduce.run_one(p, Lab()) for p in procedures]
    assert not any(r.failure for r in results)
    first = procedures[0]
    made = first._replace(name="made", title=HOSTILE, sections=("9.1",), ids=("X1", "X2"))
    lost = first._replace(name="lost", title="Lost", sections=("9.2",), ids=("Y1", "Y2"))
    shown = [
        render(number, diagrams.draw(number)._replace(claims=("X2", "elsewhere"), caption=HOSTILE))
        for number in ("4.3", "4.3", "4.19")
    ]
    results.append(Result("made", _MADE, shown, 0.1))
    results.append(reproduce.failure(lost, f"ValueError: {HOSTILE}", f"Traceback\n{HOSTILE * 9}"))
    return Reproduced(results, [*procedures, made, lost])
