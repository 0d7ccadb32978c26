"""Errata of the Preisach model, Sections 2.4.1 and 5.2.1."""

from __future__ import annotations

from macromicro.report.errata.entry import Erratum, Figure, Formula, Quote

STROKE = 3.98  # mm, Section 5.2.2


def _start() -> tuple[Figure, ...]:
    """(2.11) before any heating: the sum is empty, its first term alone is the output."""
    return (
        Figure("first term as printed, -f+, for a stroke from 0", -STROKE, "mm"),
        Figure("output of the extended actuator, f-", 0.0, "mm"),
    )


def _triangle() -> tuple[Figure, ...]:
    return (
        Figure("lower limit of the input if it is minus the upper one", -107.5, "degC"),
        Figure("temperature from which the kiln heats", 25.0, "degC"),
    )


ENTRIES = (
    Erratum(
        13, "(2.11), (5.1)", "f = -f+ + ..",
        "minus positive saturation is negative saturation only if both are opposite; the stroke "
        "runs from 0; and m_0, which the first term of the sum needs, is defined nowhere",
        "f- as the first term, m_0 = -beta_0, the lower limit of the input", _start,
        (
            Quote("2.4.1", "It should be noted that f+ = -f-"),
            Quote("5.2.2", "a contraction of approximately 3.98 mm"),
        ),
    ),
    Erratum(
        33, "Section 2.4.1", "-beta_0 = -alpha_0",
        "an input triangle symmetric about zero; temperatures of the kiln are not",
        "both limits free", _triangle,
        (
            Formula("2.4.1", "beta = -beta_0 = -alpha_0"),
            Quote("5.2.1", "then cooled back down to ambient temperature"),
        ),
    ),
)  # fmt: skip
