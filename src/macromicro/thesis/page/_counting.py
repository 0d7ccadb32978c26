"""Claims counted by verdict and by kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from macromicro.thesis.claims import (
    CALIBRATED,
    COMPUTED,
    DIFFERS,
    NOT_MEASURED,
    PREDICTED,
    REPRODUCED,
    SET,
    Claim,
)
from macromicro.thesis.reproduce import Result

KINDS = {
    CALIBRATED: "a parameter of the bench or a gain was chosen with this claim in view, the bench "
    "was made to meet it, or it follows from claims for which that was so; that it is "
    "met shows that the bench can behave so, and proves no more",
    SET: "a setting of bench or controller fixes it; the measurement only gives the setting back",
    COMPUTED: "a formula or a sum of the thesis, computed again; no bench is needed",
    PREDICTED: "measured as the thesis did; by the project's history no parameter was chosen for "
    "it, though others that were chosen for its neighbours bear on it",
}
FAILED = "procedure failed"


class Counts(NamedTuple):
    reproduced: int
    differs: int
    not_measured: int

    @property
    def total(self) -> int:
        return self.reproduced + self.differs + self.not_measured


def counts(claims: Sequence[Claim]) -> Counts:
    verdicts = [c.verdict for c in claims]
    return Counts(*(verdicts.count(v) for v in (REPRODUCED, DIFFERS, NOT_MEASURED)))


def by_kind(results: Sequence[Result]) -> list[tuple[str, str, Counts]]:
    """Kind, its meaning, counts; claims of a failed procedure have no kind."""
    good = [c for r in results if not r.failure for c in r.claims]
    found = [(k, meaning, counts([c for c in good if c.kind == k])) for k, meaning in KINDS.items()]
    lost = [c for r in results if r.failure for c in r.claims]
    if lost:
        found.append((FAILED, "not measured", counts(lost)))
    return found
