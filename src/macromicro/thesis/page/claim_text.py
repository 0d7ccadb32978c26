"""Numbers of claims in text: five significant digits, lists with commas."""

from __future__ import annotations

import math
from collections.abc import Sequence

from macromicro.thesis.claims import Claim

NOTHING = "-"
_WHOLE = 1e7  # below it no exponent is needed


def number(value: float | str) -> str:
    """Five significant digits; integers in full; NaN and infinity as ""; words unchanged."""
    if isinstance(value, str):
        return value
    if not math.isfinite(value):
        return NOTHING
    if abs(value) < _WHOLE and value == round(value):
        return str(round(value))
    text = f"{value:.5g}"
    if "e" not in text:
        return text
    if 1.0 <= abs(value) < _WHOLE:
        return f"{value:.0f}"
    digits, _, power = text.partition("e")
    return f"{digits}e{int(power)}"


def numbers(value: float | Sequence[float | str] | str | None, most: int | None = None) -> str:
    if value is None or value == "":
        return NOTHING
    if isinstance(value, str) or not isinstance(value, Sequence):
        return number(value)
    shown = [number(v) for v in value[:most]]
    left = len(value) - len(shown)
    return ", ".join(shown) + (f" and {left} more" if left else "")


def printed_text(claim: Claim, most: int | None = None) -> str:
    return numbers(claim.printed_text if claim.printed is None else claim.printed, most)


def accepted_text(claim: Claim, most: int | None = None) -> str:
    """The acceptance band of each number, else a note that a rule decides."""
    if not claim.accept:
        return "by the rule" if claim.rule else NOTHING
    shown = ", ".join(_ends(low, high) for low, high in claim.accept[:most])
    left = len(claim.accept) - len(claim.accept[:most])
    return f"{shown} and {left} more" if left else shown


def _ends(low: float, high: float) -> str:
    if math.isinf(high):
        return f"{number(low)} or more"
    return number(low) if low == high else f"{number(low)} to {number(high)}"


def notes(claim: Claim) -> list[tuple[str, str]]:
    parts = (("band of", claim.of), ("why this band", claim.basis), ("rule", claim.rule))
    return [(name, " ".join(words.split())) for name, words in parts if words]


def with_unit(text: str, unit: str) -> str:
    """`text` and its unit; units of several quantities stand in brackets."""
    if not unit or text == NOTHING:
        return text
    return f"{text} ({unit})" if "," in unit else f"{text} {unit}"
