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
    return stated(
        "D1",
        half,
        within("D1", half),
        whole=whole,
        half=half,
        rate=rate,
        pull=rate * 4e-3 / GRAM_FORCE,
    )


def _budget() -> list[Claim]:
    b = resolution.budget(SPAN, BITS, SENSITIVITY, SLOPE)
    rows = (
        ("D2", 1e3 * b.volts),
        ("D3", b.field),
        ("D4", 1e6 * resolution.metres_per_gauss(SLOPE)),
        ("D5", 1e6 * b.position),
    )
    return [stated(key, value, within(key, value)) for key, value in rows]


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
    return stated(
        "D7",
        found,
        holds(not off and best == "103MG5"),
        off="; ".join(off),
        wide=magnets.largest_change(magnets.TABLE_3_1[5], 0.04 * INCH).flux,
        best=best,
    )


def _sensor() -> list[Claim]:
    floor = resolution.sensitivity_floor(4.0, 2 * 650.0)
    needs = hall_sensors.Needs(650.0, floor)
    names = [s.name for s in hall_sensors.suitable(hall_sensors.TABLE_3_2, needs)]
    cheap = [
        s.name for s in hall_sensors.suitable(hall_sensors.TABLE_3_2, needs._replace(cost=100.0))
    ]
    good = set(names) == set(printed_list("D8")) and "SS94B1" in cheap
    return [
        stated("D8", names, holds(good), cheap=" ".join(cheap)),
        stated("D11", 1e3 * floor, within("D11", 1e3 * floor)),
    ]
