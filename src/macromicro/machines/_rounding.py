from __future__ import annotations


def rounded(value: float, digits: int = 4) -> float:
    """Round a derived setting to significant digits."""
    return float(f"{value:.{digits}g}")
