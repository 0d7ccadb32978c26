"""Errata of Chapter 3: flexure, magnets, sensors, supplies."""

from __future__ import annotations

import math

from macromicro.design import resolution
from macromicro.design.flexure_sheet import GRAM_FORCE, Beam, max_thickness
from macromicro.design.hall_sensors import TABLE_3_2, Needs, suitable
from macromicro.design.magnets import INCH, TABLE_3_1, largest_change
from macromicro.thesis.errata.entry import Figure

SENSITIVITY = 3.125e-3  # V/G


def _thickness() -> tuple[Figure, ...]:
    def of(gf: float, deflection: float, modulus: float = 70e9) -> float:
        return 1e3 * max_thickness(Beam(modulus), gf * GRAM_FORCE, deflection)

    return (
        Figure("(3.1) with 35 gf and 2 mm, as stated", of(35.0, 2e-3), "mm", 0.465),
        Figure("with 17.5 gf and 2 mm", of(17.5, 2e-3), "mm", 0.465),
        Figure("with 35 gf and 4 mm", of(35.0, 4e-3), "mm", 0.465),
        Figure("the same with 71 GPa instead of 70", of(35.0, 4e-3, 71e9), "mm", 0.465),
    )


def _magnets() -> tuple[Figure, ...]:
    best, other = TABLE_3_1[0], TABLE_3_1[5]
    inner = (other.flux[2] - other.flux[3]) / (other.distance[3] - other.distance[2]) * 1e-3
    return (
        Figure("101MG7, most over 1 mm", largest_change(other, 1e-3).flux, "G", 122.0),
        Figure("101MG7, most over 0.04 in", largest_change(other, 0.04 * INCH).flux, "G", 122.0),
        Figure("101MG7 between 0.1 and 0.2 in, per 1 mm", inner, "G", 122.0),
        Figure("103MG5, most over 0.04 in", largest_change(best, 0.04 * INCH).flux, "G", 460.0),
        Figure("103MG5, most over 1 mm", largest_change(best, 1e-3).flux, "G", 460.0),
        Figure("half of 5 V at 3.125 mV/G", 0.5 * 5.0 / SENSITIVITY, "G", 670.0),
        Figure("output over +-650 G at 3.125 mV/G", 1300.0 * SENSITIVITY, "V", 5.0),
        Figure("travel per output over those and 4 mm", 4.0 / (1300.0 * SENSITIVITY), "um/mV", 0.8),
    )


def _encoder() -> tuple[Figure, ...]:
    return (
        Figure("200 mm / 2800 counts", 200e3 / 2800.0, "um/count", 200.0),
        Figure("3000 counts at that pitch", 3000.0 * 200.0 / 2800.0, "mm", 200.0),
    )


def _volumes() -> tuple[Figure, ...]:
    bought = math.pi / 4.0 * 3.0**2 * 2.5
    wanted = math.pi / 4.0 * (0.078 * 25.4) ** 2 * (0.040 * 25.4)
    return (
        Figure("volume of the magnet bought", bought, "mm3"),
        Figure("volume of the 103MG5", wanted, "mm3"),
        Figure("ratio", bought / wanted),
    )


def _cost() -> tuple[Figure, ...]:
    return (
        Figure("sensors that meet field and sensitivity", len(suitable(TABLE_3_2, Needs())), "", 5),
        Figure("of these below 100 USD", len(suitable(TABLE_3_2, Needs(cost=100.0))), "", 5),
    )


def _resolution() -> tuple[Figure, ...]:
    found = resolution.budget(5.0, 12, SENSITIVITY, 5000.0 / INCH)
    return (Figure("resolution by the thesis' budget", 1e6 * found.position, "um/bit", 5.0),)


def _predicted() -> tuple[Figure, ...]:
    """The calibrated sensor against the budget, and the flux slope that it implies."""
    slope = 0.8e-3  # m/V
    implied = 1.0 / (slope * SENSITIVITY)  # G/m
    volts = 1.22e-3
    gauss = resolution.field(volts, SENSITIVITY)
    return (
        Figure("calibrated, 0.8 um/mV at 1.22 mV/bit",
               1e6 * resolution.calibrated(volts, slope), "um/bit", 0.976),
        Figure("predicted, 5 um/G at 0.3904 G/bit", 5.0 * gauss, "um/bit", 1.952),
        Figure("ratio", 5e-6 * gauss / resolution.calibrated(volts, slope)),
        Figure("0.8 um/mV at 3.125 mV/G", 1e6 * resolution.metres_per_gauss(implied), "um/G", 5.0),
        Figure("as a flux slope", implied * INCH, "G/in", 5000.0),
    )  # fmt: skip


def _called() -> tuple[Figure, ...]:
    volts = resolution.converter(5.0, 12)
    return (
        Figure("resolution behind 3.125 mV/G", resolution.field(volts, SENSITIVITY), "G/bit"),
        Figure("behind twice that", resolution.field(volts, 2.0 * SENSITIVITY), "G/bit"),
    )


EVIDENCE = {
    14: _thickness,
    15: _magnets,
    18: _encoder,
    25: _volumes,
    34: _cost,
    35: _resolution,
    44: _predicted,
    45: _called,
}
