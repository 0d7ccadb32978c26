"""Sensor and flexure design (Sections 3.2.2-3.2.3): claims D1-D5, D7, D8 and D11."""

from __future__ import annotations

from macromicro.design import flexure_sheet, hall_sensors, magnets, resolution
from macromicro.design.flexure_sheet import GRAM_FORCE, Beam
from macromicro.design.resolution import INCH
from macromicro.thesis.claims import Claim, band, holds, printed_list, stated, within

SPAN, BITS = 5.0, 12  # V, beside the sign bit
SENSITIVITY = 3.125e-3  # V/G, SS94B1
SLOPE = 5000.0 / INCH  # G/m at the ends of travel, read off Figure 3.7
MILLIMETRE = 1e-3


def claims() -> list[Claim]:
    return [_flexure(), *_budget(), _magnet(), *_sensor()]


def _flexure() -> Claim:
    whole = 1e3 * flexure_sheet.max_thickness(Beam(), 35 * GRAM_FORCE, 2e-3)
    half = 1e3 * flexure_sheet.max_thickness(Beam(), 17.5 * GRAM_FORCE, 2e-3)
    rate = flexure_sheet.stiffness(Beam(), 0.45e-3)
    pull = rate * 4e-3 / GRAM_FORCE
    return stated(
        "D1",
        half,
        within("D1", half),
        f"35 gf and 2 mm a beam, as stated, give {whole:.3f} mm and leave nothing of the "
        f"actuator's 70 gf for the spring; {half:.3f} mm needs half that load. The 0.45 mm "
        f"chosen make a guide of {rate:.1f} N/m, {pull:.1f} gf at 4 mm.",
    )


def _budget() -> list[Claim]:
    b = resolution.budget(SPAN, BITS, SENSITIVITY, SLOPE)
    volts, steep = 1e3 * b.volts, 1e6 * resolution.metres_per_gauss(SLOPE)
    place = 1e6 * b.position
    rows = (
        ("D2", volts),
        ("D3", b.field),
        ("D4", steep),
        ("D5", place),
    )
    why = {
        "D4": "5.08 before rounding",
        "D5": "with 5.08 um/G instead of the rounded 5",
    }
    return [stated(key, value, within(key, value), why.get(key, "")) for key, value in rows]


def _magnet() -> Claim:
    """D7: for all magnets over 1 mm."""
    found = [magnets.largest_change(m, MILLIMETRE).flux for m in magnets.TABLE_3_1]
    best = magnets.ranking(magnets.TABLE_3_1, MILLIMETRE)[0].name
    off = [
        f"{m.name} {value:.0f} G against {printed:g} G"
        for k, (m, value, printed) in enumerate(
            zip(magnets.TABLE_3_1, found, printed_list("D7"), strict=True)
        )
        if not band("D7", k)[0] <= value <= band("D7", k)[1]
    ]
    wide = magnets.largest_change(magnets.TABLE_3_1[5], 0.04 * INCH).flux
    return stated(
        "D7",
        found,
        holds(not off and best == "103MG5"),
        f"{'; '.join(off)}: it changes most between 0.04 and 0.1 in ({wide:.0f} G per 0.04 in), "
        "the printed value is that of 0.1 to 0.2 in. The others agree within 2 %, although the "
        f"first two are printed per 0.04 in, the rest per 1 mm. Most of all changes {best}.",
    )


def _sensor() -> list[Claim]:
    floor = resolution.sensitivity_floor(4.0, 2 * 650.0)
    needs = hall_sensors.Needs(650.0, floor)
    names = [s.name for s in hall_sensors.suitable(hall_sensors.TABLE_3_2, needs)]
    cheap = [
        s.name for s in hall_sensors.suitable(hall_sensors.TABLE_3_2, needs._replace(cost=100.0))
    ]
    return [
        stated(
            "D8",
            names,
            holds(set(names) == set(printed_list("D8")) and "SS94B1" in cheap),
            f"Below 100 USD: {' '.join(cheap)}; these have equal rows, "
            "so the SS94B1 rests on tolerances that the thesis mentions but does not print.",
        ),
        stated(
            "D11",
            1e3 * floor,
            within("D11", 1e3 * floor),
            "3.08 before rounding",
        ),
    ]
