from __future__ import annotations


def round_to(value: float, digits: int = 4) -> float:
    """Round a derived setting to significant digits."""
    return float(f"{value:.{digits}g}")
