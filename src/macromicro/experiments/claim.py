"""A claim as data: what the thesis prints, what was measured here, and the verdict."""

from __future__ import annotations

import math
from typing import NamedTuple

REPRODUCED, DIFFERS, NOT_MEASURED = "reproduced", "differs", "not measured"
CALIBRATED, COMPUTED, PREDICTED = "calibrated", "computed", "predicted"
SET = "set"
# What the history tells of M9, M14 and A4, for which no parameter is named.
MET = (
    "the bench was made to meet it from its first sketch on; which parameter was turned for it "
    "is not recorded"
)
KINDS = (CALIBRATED, SET, COMPUTED, PREDICTED)

Number = float | list[float] | list[str] | None


class Claim(NamedTuple):
    """One claim of the thesis.

    `printed` and `measured` are numbers, lists of numbers or names, or None where the claim
    has none; `printed_text` is what the thesis prints in words. `kind`: `calibrated` (a
    parameter of the bench or a gain was chosen with it in view, the bench was made to meet it, or
    it follows from claims for which that was so), `set` (a setting fixes it, and the
    measurement gives the setting back), `computed` (arithmetic) or `predicted` (none of these).
    `reason` says why it differs, or what the agreement rests on.
    """

    id: str
    section: str
    claim: str
    printed: Number
    measured: Number
    unit: str
    verdict: str
    reason: str = ""
    kind: str = PREDICTED
    printed_text: str = ""


def within(measured: float, low: float, high: float) -> str:
    """The verdict for a number that must lie within bounds; NaN counts as not measured."""
    if math.isnan(measured):
        return NOT_MEASURED
    return REPRODUCED if low <= measured <= high else DIFFERS


def reached(measured: float, low: float, high: float) -> str:
    """As `within`, for a time until something happens: NaN says that it never did in a run
    that was whole, and differs."""
    return DIFFERS if math.isnan(measured) else within(measured, low, high)


def holds(good: bool) -> str:
    """The verdict for a claim that holds or does not."""
    return REPRODUCED if good else DIFFERS
