"""Optical encoder and its 24-bit counter (Section 3.1); converters of the board (3.2.3)."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.kernel import kernel
from macromicro.schema.par import Par


class Encoder(NamedTuple):
    """A strip read in quadrature; the counter wraps at 24 bits."""

    pitch: Annotated[
        float,
        Par(
            "m",
            "travel per count",
            "calibrated to M16: 200 mm = 2800 counts",
            shown="um",
            positive=True,
        ),
    ] = nominal.PITCH
    bits: Annotated[
        float, Par("", "width of the counter", "MultiQ-3 board, Section 3.3", lo=8, hi=48)
    ] = 24.0


class Converter(NamedTuple):
    """A/D converter: 12 bits plus sign over +-5 V, 1.22 mV per bit (Section 3.2.3)."""

    full_scale: Annotated[
        float, Par("V", "A/D range, both signs", "Section 3.2.3", positive=True)
    ] = nominal.FULL_SCALE
    bits: Annotated[float, Par("", "A/D bits beside the sign", "Section 3.2.3", lo=6, hi=24)] = 12.0


@kernel
def count(p: Encoder, x: float) -> float:
    """Counter reading, signed, wrapped to its bits."""
    # 1e-9 counts of slack: a position set on an edge must not fall below it by rounding.
    steps = math.floor(x / p.pitch + 1e-9)
    span: float = 2.0**p.bits
    return steps - span * math.floor(steps / span + 0.5)


@kernel
def sample(p: Converter, volts: float) -> float:
    """A/D reading: rounded to a code and clipped to the range."""
    lsb: float = p.full_scale / 2.0**p.bits
    limited = min(max(volts, -p.full_scale), p.full_scale - lsb)
    return math.floor(limited / lsb + 0.5) * lsb
