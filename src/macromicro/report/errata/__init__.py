"""Misprints and contradictions of the thesis: a list of data, numbered from 1.

`ERRATA` holds them in order; `evidence` puts one's proof into words.
"""

from __future__ import annotations

from macromicro.report.errata import hysteresis, macro, micro, sensors, system
from macromicro.report.errata.entry import Erratum, Figure, Formula, Quote, evidence

__all__ = ["ERRATA", "Erratum", "Figure", "Formula", "Quote", "evidence"]

ERRATA: tuple[Erratum, ...] = tuple(
    sorted(
        (*macro.ENTRIES, *micro.ENTRIES, *hysteresis.ENTRIES, *sensors.ENTRIES, *system.ENTRIES),
        key=lambda e: e.number,
    )
)
