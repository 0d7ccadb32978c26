"""What a client sent may be anything: how is it shown in a refusal, is it one of these words?"""

from __future__ import annotations

from typing import Any

_MOST = 80  # characters


def shown(value: Any, most: int = _MOST) -> str:
    """`value` as Python writes it, no longer than `most` characters."""
    try:
        words = repr(value)
    except Exception:  # a whole number of thousands of digits, or an object of somebody's own
        words = f"<{type(value).__name__}>"
    return words if len(words) <= most else words[: most - 3] + "..."


def among(value: Any, words: tuple[str, ...]) -> bool:
    """Is it one of these words? What is no word (an array, whose comparison is none) is not."""
    return isinstance(value, str) and value in words
