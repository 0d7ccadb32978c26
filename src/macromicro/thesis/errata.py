"""Misprints and contradictions of the thesis, numbered from 1, as `errata.toml` lists them."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, NamedTuple


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
    quotes: tuple[Quote, ...]
    figures: tuple[Figure, ...]


def evidence(entry: Erratum) -> list[str]:
    """The evidence in words, a line each: quotes first, then the recomputed numbers."""
    lines = [
        f"{q.place}: {q.words}" if q.formula else f"{q.place}: “{q.words}”" for q in entry.quotes
    ]
    return lines + [_line(figure) for figure in entry.figures]


def _line(figure: Figure) -> str:
    unit = f" {figure.unit}" if figure.unit else ""
    against = "" if figure.printed is None else f" (printed: {figure.printed:g}{unit})"
    return f"{figure.what}: {figure.value:.5g}{unit}{against}"


def _erratum(row: dict[str, Any]) -> Erratum:
    quotes = tuple(
        Quote(q["place"], q.get("words") or q["formula"], "formula" in q)
        for q in row.pop("quotes", ())
    )
    figures = tuple(Figure(**figure) for figure in row.pop("figures", ()))
    return Erratum(**row, quotes=quotes, figures=figures)


_ROWS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["erratum"]
ERRATA = tuple(_erratum(row) for row in _ROWS)
