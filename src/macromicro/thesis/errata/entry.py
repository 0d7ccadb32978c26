"""An erratum: a misprint or a contradiction, its evidence, and the reading used."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Figure(NamedTuple):
    """A recomputed number with its unit, and the printed one."""

    what: str
    value: float
    unit: str = ""
    printed: float | None = None


class Quote(NamedTuple):
    place: str
    words: str
    formula: bool = False


class Erratum(NamedTuple):
    """One entry; its evidence is recomputed numbers, contradicting quotes, or both."""

    number: int
    place: str
    printed: str
    fault: str  # what is wrong
    reading: str  # what is used here
    quotes: tuple[Quote, ...] = ()
    recompute: Callable[[], tuple[Figure, ...]] | None = None


def evidence(entry: Erratum) -> list[str]:
    """The evidence in words, a line each: quotes first, then the recomputed numbers."""
    lines = [
        f"{q.place}: {q.words}" if q.formula else f"{q.place}: “{q.words}”" for q in entry.quotes
    ]
    figures = entry.recompute() if entry.recompute else ()
    return lines + [_line(f) for f in figures]


def _line(figure: Figure) -> str:
    unit = f" {figure.unit}" if figure.unit else ""
    against = "" if figure.printed is None else f" (printed: {figure.printed:g}{unit})"
    value = figure.value if abs(figure.value) > 1e-12 else 0.0  # the rounding of a zero
    return f"{figure.what}: {value:.5g}{unit}{against}"
