"""Two-tap PD controllers (4.9) and (4.10): D(z) = (now z + before) / z, errors in counts."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.control.law import Law
from macromicro.control.pid import STEEPEST
from macromicro.kernel import kernel
from macromicro.schema.par import Par

PRESENT, PAST = "weight of the present error", "weight of the error one period ago"


def _tap(meaning: str, source: str) -> Par:
    return Par("V/count", meaning, source, lo=-STEEPEST, hi=STEEPEST)


class PdInitial(NamedTuple):
    """(4.9), designed on the linear model for a damping ratio of 1."""

    now: Annotated[float, _tap(PRESENT, "(4.9)")] = 0.00245865
    before: Annotated[float, _tap(PAST, "(4.9)")] = 0.0000998447


class PdTuned(NamedTuple):
    """(4.10) with the minus sign: only that puts the crossover at 4.91 rad/s."""

    now: Annotated[float, _tap(PRESENT, "(4.10)")] = 0.0124593
    before: Annotated[float, _tap(PAST, "(4.10), sign corrected")] = -0.0112178


class PdMemory(NamedTuple):
    error: Annotated[float, Meaning("error of the last period", "count")]


@kernel
def start(error: Annotated[float, Meaning("taken as the last one", "count")]) -> PdMemory:
    """The memory before the first period (`error` in counts)."""
    return PdMemory(error)


@kernel
def effort(now: float, before: float, error: float, past: float) -> float:
    """Effort from this and the last error in counts: (4.9), (4.10)."""
    return now * error + before * past


@kernel
def step(
    p: PdInitial | PdTuned, s: PdMemory, error: float, dt: float
) -> tuple[
    Annotated[PdMemory, Meaning(name="memory")],
    Annotated[float, Meaning("effort", "V", name="effort")],
]:
    """One period of the PD (`error` in counts)."""
    return PdMemory(error), effort(p.now, p.before, error, s.error)


LAWS = (
    Law("pd-initial", PdInitial, start, step),
    Law("pd-tuned", PdTuned, start, step),
)
