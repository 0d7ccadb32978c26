"""Procedures carried out on the default benches, once in a process, for the tests of claims."""

from __future__ import annotations

from functools import cache
from typing import Any

from macromicro.thesis import all_procedures
from macromicro.thesis.claims import Claim
from macromicro.thesis.procedure import Lab
from macromicro.thesis.reproduce import Result, run_one

PROCEDURES = {p.name: p for p in all_procedures()}
WHERE = {name: p for p in PROCEDURES.values() for name in p.ids}


@cache
def collected(name: str) -> Any:
    """What the procedure collects."""
    return PROCEDURES[name].collect(Lab())


@cache
def ended(name: str) -> Result:
    """Its result, figures included."""
    known = PROCEDURES[name]._replace(collect=lambda lab: collected(name))
    return run_one(known, Lab())


def measured(claim: str) -> Claim:
    """A claim as its procedure measures it."""
    result = ended(WHERE[claim].name)
    assert not result.failure, result.trace
    return next(c for c in result.claims if c.id == claim)
