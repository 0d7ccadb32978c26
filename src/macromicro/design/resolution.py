"""Resolution budget of a magnetic position sensor (Section 3.2.3, "Target Accuracy").

Converter -> field -> position. Volts and metres; field in gauss, as the data sheets have it
(1 G = 1e-4 T). All functions raise `InputError` for numbers that are not above zero.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.design.checks import positive
from macromicro.schema import keys

INCH = 0.0254  # m
MAX_BITS = 64


class Budget(NamedTuple):
    """What one bit of the converter is worth.

    Attributes
    ----------
    volts : float
        V.
    field : float
        G.
    position : float
        m.
    """

    volts: float
    field: float
    position: float


def converter(span: float, bits: int) -> float:
    """Resolution of a converter: span / 2^bits.

    A sign bit beside them doubles the range, not the resolution.

    Parameters
    ----------
    span : float
        Span, V.
    bits : int
        Without the sign.

    Returns
    -------
    float
        V/bit.

    Raises
    ------
    InputError
        A number is not above zero, or `bits` is not whole.
    """
    positive("resolution, span", span, "V")
    return float(span / 2.0 ** keys.whole(bits, 1, MAX_BITS, "resolution, bits"))


def field(volts_per_bit: float, sensitivity: float) -> float:
    """Resolution behind a sensor: (V/bit) / (V/G).

    Parameters
    ----------
    volts_per_bit : float
        Volts per bit, V/bit.
    sensitivity : float
        Sensitivity, V/G.

    Returns
    -------
    float
        G/bit.

    Raises
    ------
    InputError
        A number is not above zero.
    """
    return positive("resolution, volts per bit", volts_per_bit, "V/bit") / positive(
        "resolution, sensitivity", sensitivity, "V/G"
    )


def metres_per_gauss(slope: float) -> float:
    """Travel per field: 1 / slope.

    Parameters
    ----------
    slope : float
        Slope of the flux, G/m.

    Returns
    -------
    float
        m/G.

    Raises
    ------
    InputError
        `slope` is not above zero.
    """
    return 1.0 / positive("resolution, flux slope", slope, "G/m")


def sensitivity_floor(output: float, field_span: float) -> float:
    """Least useful sensitivity: output range over the field's span.

    Parameters
    ----------
    output : float
        Output, V.
    field_span : float
        Both signs, G.

    Returns
    -------
    float
        V/G.

    Raises
    ------
    InputError
        A number is not above zero.
    """
    return positive("resolution, output range", output, "V") / positive(
        "resolution, field span", field_span, "G"
    )


def budget(span: float, bits: int, sensitivity: float, slope: float) -> Budget:
    """The whole chain: converter, sensor, flux.

    Parameters
    ----------
    span : float
        Span of the converter, V.
    bits : int
        Bits of the converter, without the sign.
    sensitivity : float
        Sensitivity of the sensor, V/G.
    slope : float
        Slope of the flux in the flattest part of the travel, its ends, G/m: there a bit is worth
        most.

    Returns
    -------
    Budget
        What a bit is worth.

    Raises
    ------
    InputError
        A number is not above zero, or `bits` is not whole.
    """
    volts = converter(span, bits)
    gauss = field(volts, sensitivity)
    return Budget(volts, gauss, gauss * metres_per_gauss(slope))


def calibrated(volts_per_bit: float, slope: float) -> float:
    """Resolution of a sensor calibrated as a whole: the product of both.

    Parameters
    ----------
    volts_per_bit : float
        Volts per bit, V/bit.
    slope : float
        Slope, m/V.

    Returns
    -------
    float
        m/bit.

    Raises
    ------
    InputError
        A number is not above zero.
    """
    return positive("resolution, volts per bit", volts_per_bit, "V/bit") * positive(
        "resolution, slope", slope, "m/V"
    )
