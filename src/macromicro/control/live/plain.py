"""What a client sent may be anything: how is it shown in a refusal, is it one of these words?"""

from __future__ import annotations

from typing import Any

_MOST = 80  # characters


def shown(value: Any, most: int = _MOST) -> str:
    """A value as Python writes it, cut to length.

    Parameters
    ----------
    value : Any
        Anything that a client sent.
    most : int, optional
        Characters.

    Returns
    -------
    str
        On one line where its own form is.
    """
    try:
        words = repr(value)
    except Exception:  # a whole number of thousands of digits, or an object of somebody's own
        words = f"<{type(value).__name__}>"
    return words if len(words) <= most else words[: most - 3] + "..."


def among(value: Any, words: tuple[str, ...]) -> bool:
    """Whether a value is one of some words. What is no word (an array, whose comparison is none) is
    not.

    Parameters
    ----------
    value : Any
        Anything that a client sent.
    words : tuple[str, ...]
        Accepted ones.

    Returns
    -------
    bool
        True if so.
    """
    return isinstance(value, str) and value in words
