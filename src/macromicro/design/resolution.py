"""Resolution budget of a magnetic position sensor (Section 3.2.3, "Target Accuracy").

Converter -> field -> position. Volts and metres; field in gauss, as the data sheets have it
(1 G = 1e-4 T). All functions raise `InputError` for numbers that are not above zero.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.design._checks import positive
from macromicro.schema import keys

INCH = 0.0254  # m
MAX_BITS = 64


class Budget(NamedTuple):
    """What one bit of the converter is worth."""

    volts: float  #: V
    field: float  #: G
    position: float  #: m


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

    Examples
    --------
    >>> from macromicro.design import converter
    >>> round(converter(span=10.0, bits=15) * 1e3, 3)  # mV per bit
    0.305
    """
    positive("resolution, span", span, "V")
    return float(span / 2.0 ** keys.whole(bits, 1, MAX_BITS, "resolution, bits"))


def field(volts_per_bit: float, sensitivity: float) -> float:
    """Resolution behind a sensor: (V/bit) / (V/G)."""
    return positive("resolution, volts per bit", volts_per_bit, "V/bit") / positive(
        "resolution, sensitivity", sensitivity, "V/G"
    )


def metres_per_gauss(slope: float) -> float:
    """Travel per field: 1 / `slope` [G/m]."""
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

    Examples
    --------
    >>> from macromicro.design import sensitivity_floor
    >>> sensitivity_floor(output=4.0, field_span=1000.0)  # V/G, for -500 to 500 G
    0.004
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

    Examples
    --------
    >>> from macromicro.design import budget
    >>> one_bit = budget(span=10.0, bits=15, sensitivity=3e-3, slope=1e5)
    >>> round(one_bit.position * 1e6, 3)  # um
    1.017
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

    Examples
    --------
    >>> from macromicro.design import calibrated, converter
    >>> per_bit = calibrated(converter(span=10.0, bits=15), slope=2e-3)  # 2 mm/V
    >>> round(per_bit * 1e6, 3)  # um
    0.61
    """
    return positive("resolution, volts per bit", volts_per_bit, "V/bit") * positive(
        "resolution, slope", slope, "m/V"
    )
