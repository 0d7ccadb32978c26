"""All that the thesis states and that is measured here, as data: one `Statement` each, in the
order of the list of claims. What was measured is put beside it by `stated`."""

from __future__ import annotations

from collections.abc import Iterable

from macromicro.experiments.claim import NOT_MEASURED, Claim, Number
from macromicro.experiments.statements import cycles, design, macro, micro, whole
from macromicro.experiments.statements.statement import Statement

STATEMENTS: dict[str, Statement] = {
    s.id: s for part in (design, macro, micro, whole, cycles) for s in part.STATEMENTS
}
_PLACE = {name: k for k, name in enumerate(STATEMENTS)}


def stated(name: str, measured: Number, verdict: str, reason: str = "") -> Claim:
    """The claim `name` with what was measured. Raises KeyError for one that is not listed."""
    s = STATEMENTS[name]
    return Claim(
        s.id,
        s.section,
        s.claim,
        s.printed,
        measured,
        s.unit,
        verdict,
        reason,
        s.kind,
        s.printed_text,
    )


def lost(name: str, reason: str) -> Claim:
    """The claim `name`, not measured. One that is not listed has no words and no kind."""
    if name in STATEMENTS:
        return stated(name, None, NOT_MEASURED, reason)
    return Claim(name, "", "Not measured", None, None, "", NOT_MEASURED, reason, kind="")


def in_order(claims: Iterable[Claim]) -> list[Claim]:
    """The claims as the list has them; those that it lacks last, in the order they came."""
    return sorted(claims, key=lambda c: _PLACE.get(c.id, len(_PLACE)))
