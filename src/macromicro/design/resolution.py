"""Resolution budget of a magnetic position sensor (Section 3.2.3, "Target Accuracy").

Converter -> field -> position. Volts and metres; field in gauss, as the data sheets have it
(1 G = 1e-4 T). All functions raise `InputError` for numbers that are not above zero.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.design.checks import positive, whole

INCH = 0.0254  # m
MAX_BITS = 64


class Budget(NamedTuple):
    """What one bit of the converter is worth: [V], [G], [m]."""

    volts: float
    field: float
    position: float


def converter(span: float, bits: int) -> float:
    """Resolution [V/bit] of a converter with 2^bits steps over `span` [V]: span / 2^bits.

    A sign bit beside them doubles the range, not the resolution.
    """
    positive("resolution, span", span, "V")
    return float(span / 2.0 ** whole("resolution, bits", bits, 1, MAX_BITS))


def field(volts_per_bit: float, sensitivity: float) -> float:
    """Resolution [G/bit] behind a sensor of `sensitivity` [V/G]: (V/bit) / (V/G)."""
    return positive("resolution, volts per bit", volts_per_bit, "V/bit") / positive(
        "resolution, sensitivity", sensitivity, "V/G"
    )


def metres_per_gauss(slope: float) -> float:
    """Travel per field [m/G] where the flux changes by `slope` [G/m]: 1 / slope."""
    return 1.0 / positive("resolution, flux slope", slope, "G/m")


def sensitivity_floor(output: float, field_span: float) -> float:
    """Least useful sensitivity [V/G]: output range [V] over the field's span [G] (both signs)."""
    return positive("resolution, output range", output, "V") / positive(
        "resolution, field span", field_span, "G"
    )


def budget(span: float, bits: int, sensitivity: float, slope: float) -> Budget:
    """The whole chain for a converter [V, bits], a sensor [V/G] and a flux slope [G/m].

    The slope is that of the flattest part of the travel, its ends: there a bit is worth most.
    """
    volts = converter(span, bits)
    gauss = field(volts, sensitivity)
    return Budget(volts, gauss, gauss * metres_per_gauss(slope))


def calibrated(volts_per_bit: float, slope: float) -> float:
    """Resolution [m/bit] of a sensor calibrated as a whole, with `slope` [m/V]: their product."""
    return positive("resolution, volts per bit", volts_per_bit, "V/bit") * positive(
        "resolution, slope", slope, "m/V"
    )
