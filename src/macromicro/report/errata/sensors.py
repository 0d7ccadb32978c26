"""Errata of Chapter 3: flexure, magnets, sensors, supplies."""

from __future__ import annotations

import math

from macromicro.design import resolution
from macromicro.design.flexure_sheet import GRAM_FORCE, Beam, max_thickness
from macromicro.design.hall_sensors import TABLE_3_2, Needs, suitable
from macromicro.design.magnets import INCH, TABLE_3_1, largest_change
from macromicro.report.errata.entry import Erratum, Figure, Quote

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


ENTRIES = (
    Erratum(
        14, "Section 3.2.2", "greatest thickness 0.465 mm",
        "(3.1) gives more with the stated load and deflection; the printed value needs about half "
        "the load, or twice the deflection",
        "0.45 mm, the thickness chosen and built", _thickness,
        (Quote("3.2.2", "at least 2 mm for a 35 gf load"),),
    ),
    Erratum(
        15, "Tables 3.1 and 3.2, Section 3.2.3", "101MG7: 122; \"three requirements\"; 0-5 V",
        "101MG7 changes more, closer in; two columns are per 0.04 in, five per 1 mm; four "
        "requirements are listed; 0-5 V would need a field beyond the sensor's range",
        "one basis, 1 mm; four requirements; the calibration's slope as measured", _magnets,
        (
            Quote("3.2.3", "The three requirements are:"),
            Quote("3.2.3, the fourth", "the monetary cost must be as low as possible"),
            Quote("3.2.3", "no longer saturated at each end of travel"),
        ),
    ),
    Erratum(
        18, "Chapters 3 and 4", "200 um precision; 2800 and 3000 counts",
        "200 mm over 2800 counts is a finer pitch than 200 um; full travel is 2800 counts in one "
        "section, at most 3000 in another",
        "2800 counts are 200 mm; 3000 counts only as a step for design", _encoder,
        (
            Quote("3.1", "approximately 200 um resolution"),
            Quote("4.3.1", "corresponding approximately to full macro-stage travel"),
            Quote("4.3.3", "3000 counts, the maximum travel of the system"),
        ),
    ),
    Erratum(
        20, "Section 3.2.1, Appendix D", "supply of 4 V and PWM of 20 V; 5 V, linear",
        "thesis and paper drive the same actuator differently",
        "4 V on the stage, 5 V in the cycle tests", None,
        (
            Quote("3.2.1", "a 4 V electrical power supply"),
            Quote("3.2.1", "a 20 V PWM amplifier with the duty cycle tuned to 0 - 20 %"),
            Quote("Appendix D", "It is electrically powered by a five volt supply"),
            Quote("Appendix D", "linearly regulated through internal circuitry"),
        ),
    ),
    Erratum(
        21, "Section 3.2.1", "wires \"in series\" and in \"parallel configuration\"",
        "mechanically they are in series: their strokes add up",
        "one wire with the sum of the strokes, under the whole load", None,
        (
            Quote("3.2.1", "six NiTi SMA wires in series"),
            Quote("3.2.1", "SMA wires arranged in parallel configuration"),
            Quote("3.2.1", "is the sum of all the"),
        ),
    ),
    Erratum(
        24, "Chapter 3, Section 6.1", "the laser measures absolute positions",
        "it is reset after every macro move and then measures from there",
        "position since the last reset, with the carriage's motion in it", None,
        (
            Quote("3", "to measure the absolute position of both the macro- and micro-stages"),
            Quote("6.1", "the laser is reset after the macro-stage reaches its setpoint"),
        ),
    ),
    Erratum(
        25, "Section 3.2.3, Appendix D", "a magnet \"of similar size\"",
        "the one bought has several times the volume, and the paper names the one not bought",
        "neither data sheet: the profile follows from the calibration (D6)", _volumes,
        (
            Quote("3.2.3", "an equivalent magnet of similar size and material was chosen"),
            Quote("Appendix D", "two magnets (Micro Switch 103MG5)"),
        ),
    ),
    Erratum(
        34, "Section 3.2.3, Table 3.2", "five sensors meet all requirements",
        "the cost is to be below 100 USD and the programmable sensor's is about 100 USD; the "
        "tolerances that decide among the other four are not printed",
        "the five by field and sensitivity; the SS94B1 as the thesis' choice", _cost,
        (
            Quote("3.2.3", "be of low cost (< $100)"),
            Quote("3.2.3", "is programmable and meets all the requirements"),
        ),
    ),
    Erratum(
        35, "Appendix D", "measurement resolution of 5 um",
        "5 um is the accuracy aimed at; the same parts resolve less than half of it",
        "one bit is worth about 1 um after calibration (D6)", _resolution,
        (
            Quote("Appendix D", "linear measurement resolution of approximately 5 um"),
            Quote("3.2.3", "a resolution of 1.952 um/bit results"),
        ),
    ),
    Erratum(
        44, "Section 3.2.3", "1.952 um/bit expected, 0.976 um/bit calibrated",
        "exactly half, which is passed over as an improvement; the calibrated slope is that of "
        "about 10 000 G/in, twice the field slope of the estimate",
        "the calibrated slope as measured; the estimate as printed (D5, D6)", _predicted,
        (
            Quote("3.2.3", "the slope for the flux at the extremes of travel is approximately"),
            Quote("3.2.3", "This is better than the previously estimated resolution"),
        ),
    ),
    Erratum(
        45, "Section 3.2.3", "3.125 mV/G as a resolution",
        "it is the sensitivity, as Table 3.2 heads it: twice as much of it resolves twice as "
        "finely",
        "sensitivity; the resolution is that of the converter divided by it", _called,
        (
            Quote("3.2.3", "has a resolution of at most 3.125 mV/Gauss"),
            Quote("Table 3.2", "Sensitivity (mV/Gauss)"),
            Quote("3.2.3", "the sensor sensitivity should be as large as possible"),
        ),
    ),
)  # fmt: skip
