"""Every numbered equation of the thesis can be asked for."""

from __future__ import annotations

import pytest

from macromicro.errors import InputError
from macromicro.thesis import all_procedures
from macromicro.thesis.choosing import EQUATIONS, choose

PROCEDURES = all_procedures()
NUMBERS = [
    *(f"2.{k}" for k in range(1, 12)),
    "3.1",
    *(f"4.{k}" for k in range(1, 11)),
    *(f"5.{k}" for k in range(1, 10)),
]


@pytest.mark.parametrize("number", NUMBERS)
def test_each_leads_to_what_measures_or_shows_it(number: str) -> None:
    """Whatever stands in the table exists, and is what is chosen."""
    chosen = choose([f"({number})"], PROCEDURES)
    whole = {c.procedure.name for c in chosen if c.ids is None}
    found = whole.union(*(c.ids or () for c in chosen), *(c.figures or () for c in chosen))
    assert found == {name.removeprefix("Figure ") for name in EQUATIONS[number]}
    assert choose([f"Equation {number}"], PROCEDURES) == chosen


def test_no_other_is_in_the_table() -> None:
    assert sorted(EQUATIONS) == sorted(NUMBERS)


def test_what_the_thesis_has_not_is_refused_with_what_it_has() -> None:
    with pytest.raises(InputError, match=r"\(9\.9\).*equation of the thesis.*\(5\.9\)"):
        choose(["(9.9)"], PROCEDURES)


def test_the_jump_of_the_dead_zone_is_two_claims() -> None:
    (chosen,) = choose(["(4.5)"], PROCEDURES)
    assert chosen.ids == {"M6a", "M6b"}
