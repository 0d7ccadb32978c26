"""Numbers of claims as a person reads them: five significant digits, lists with commas."""

from __future__ import annotations

import math
from collections.abc import Sequence

from macromicro.thesis.claims import Claim

NOTHING = "-"
_WHOLE = 1e7  # below it no exponent is needed


def number(value: float | str) -> str:
    """Five significant digits; whole numbers whole; NaN and infinity as nothing; words as
    they are."""
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
    """A number, or a list of them; of a longer one the first `most`, and how many follow."""
    if value is None or value == "":
        return NOTHING
    if isinstance(value, str) or not isinstance(value, Sequence):
        return number(value)
    shown = [number(v) for v in value[:most]]
    left = len(value) - len(shown)
    return ", ".join(shown) + (f" and {left} more" if left else "")


def printed(claim: Claim, most: int | None = None) -> str:
    """What the thesis prints, without unit: numbers, else words."""
    return numbers(claim.printed_text if claim.printed is None else claim.printed, most)


def with_unit(text: str, unit: str) -> str:
    """`text` and its unit; units of several quantities stand in brackets."""
    if not unit or text == NOTHING:
        return text
    return f"{text} ({unit})" if "," in unit else f"{text} {unit}"
