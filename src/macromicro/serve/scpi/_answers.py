"""Response data in SCPI notation."""

from __future__ import annotations

import math

NOT_A_NUMBER = "9.91E37"  # SCPI-99, volume 1, 7.2.1.5
INFINITE = "9.9E37"


def number(x: float, digits: int = 9) -> str:
    if math.isnan(x):
        return NOT_A_NUMBER
    if math.isinf(x):
        return INFINITE if x > 0 else f"-{INFINITE}"
    return f"{x:.{digits}g}".replace("e", "E")


def numbers(*xs: float) -> str:
    return ",".join(number(x) for x in xs)


def flag(on: bool) -> str:
    return "1" if on else "0"


def block(data: bytes) -> bytes:
    """Definite-length arbitrary block response data (IEEE 488.2, 8.7.9)."""
    length = str(len(data)).encode()
    return b"#" + str(len(length)).encode() + length + data
