"""Derived settings to the digits that they deserve."""

from __future__ import annotations


def rounded(value: float, digits: int = 4) -> float:
    """To some significant digits: a derived setting claims no more.

    Parameters
    ----------
    value : float
        Any number.
    digits : int, optional
        How many.

    Returns
    -------
    float
        The nearest of these.
    """
    return float(f"{value:.{digits}g}")
