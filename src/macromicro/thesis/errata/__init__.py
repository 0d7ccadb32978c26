"""Misprints and contradictions of the thesis, numbered from 1.

The words are data, `errata.toml`; recomputed numbers are functions here, under the erratum's
number.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from macromicro.thesis.errata import macro, micro, sensors, system
from macromicro.thesis.errata.entry import Erratum, Figure, Quote, evidence

__all__ = ["ERRATA", "Erratum", "Figure", "Quote", "evidence"]

_LIST = Path(__file__).with_name("errata.toml")
_EVIDENCE: dict[int, Callable[[], tuple[Figure, ...]]] = (
    macro.EVIDENCE | micro.EVIDENCE | sensors.EVIDENCE | system.EVIDENCE
)


def _erratum(row: dict[str, Any]) -> Erratum:
    quotes = tuple(
        Quote(q["place"], q.get("words") or q["formula"], "formula" in q)
        for q in row.pop("quotes", ())
    )
    return Erratum(**row, quotes=quotes, recompute=_EVIDENCE.get(row["number"]))


ERRATA = tuple(_erratum(row) for row in tomllib.loads(_LIST.read_text(encoding="utf-8"))["erratum"])
