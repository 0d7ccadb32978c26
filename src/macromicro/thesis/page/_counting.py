"""Claims counted by verdict and by kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from macromicro.thesis.claims import DIFFERS, NOT_MEASURED, REPRODUCED, Claim
from macromicro.thesis.contents import KINDS
from macromicro.thesis.reproduce import Result

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
