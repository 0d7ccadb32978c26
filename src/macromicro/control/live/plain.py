"""Safe handling of values that a client sent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

_MOST = 80  # characters


def show(value: Any, most: int = _MOST) -> str:
    """A value as Python writes it, shortened."""
    try:
        words = repr(value)
    except Exception:  # a whole number of thousands of digits, or an object of somebody's own
        words = f"<{type(value).__name__}>"
    return words if len(words) <= most else words[: most - 3] + "..."


def list_names(names: Sequence[str], word: str = "or") -> str:
    """Names in quotes, for a message."""
    quoted = [f'"{name}"' for name in names]
    return f" {word} ".join([", ".join(quoted[:-1]), quoted[-1]] if quoted[1:] else quoted)


def among(value: Any, words: tuple[str, ...]) -> bool:
    """Whether a value is one of some words; safe for arrays."""
    return isinstance(value, str) and value in words
