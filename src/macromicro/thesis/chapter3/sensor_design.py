"""Magnets and Hall sensors (Section 3.2.3): figures, tables, and the procedure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.design import flexure_sheet, hall_sensors, magnets, resolution
from macromicro.design.flexure_sheet import GRAM_FORCE, Beam
from macromicro.design.resolution import INCH
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, finish, line, new
from macromicro.plant import hall
from macromicro.plant.hall import Hall
from macromicro.thesis.claims import Claim, band, printed_list, state
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from numpy.typing import NDArray


SPAN, BITS = 5.0, 12  # V, beside the sign bit
SENSITIVITY = 3.125e-3  # V/G, SS94B1
SLOPE = 5000.0 / INCH  # G/m at the ends of travel, read off Figure 3.7
MILLIMETRE = 1e-3


def measure() -> list[Claim]:
    return [_flexure(), *_bits(), _magnet(), *_sensor()]


def _flexure() -> Claim:
    whole = 1e3 * flexure_sheet.max_thickness(Beam(), 35 * GRAM_FORCE, 2e-3)
    half = 1e3 * flexure_sheet.max_thickness(Beam(), 17.5 * GRAM_FORCE, 2e-3)
    rate = flexure_sheet.stiffness(Beam(), 0.45e-3)
    return state("D1", half, whole=whole, half=half, rate=rate, pull=rate * 4e-3 / GRAM_FORCE)


def _bits() -> list[Claim]:
    b = resolution.budget(SPAN, BITS, SENSITIVITY, SLOPE)
    rows = (
        ("D2", 1e3 * b.volts),
        ("D3", b.field),
        ("D4", 1e6 * resolution.metres_per_gauss(SLOPE)),
        ("D5", 1e6 * b.position),
    )
    return [state(key, value) for key, value in rows]


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
    return state(
        "D7",
        found,
        not off and best == "103MG5",
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
    return [state("D8", names, good, cheap=" ".join(cheap)), state("D11", 1e3 * floor)]


CHOSEN = 0.45e-3  # m, Section 3.2.2
LOADS = (17.5, 35.0)  # gf a beam: half of the stated load, and the stated load
HALF_STROKE, STROKE = 2e-3, 4e-3
_COLOURS = (BLUE, RED, GREEN, ORANGE, PURPLE, BLACK, "0.55")

BUDGET = ("D2", "D3", "D4", "D5", "D11")


def flexure(data: Sheets) -> Drawn:
    """Figure 3.6: bending of beams and guide, and deflection over load."""
    beam = Beam()
    figure, axes = new(4.0, 1, 3, gridspec_kw={"width_ratios": [1, 1.1, 1.5]})
    single, guide, load = axes[0]
    for k, way in enumerate((0.5e-3, 1e-3, 1.5e-3, HALF_STROKE)):
        along, aside, _ = flexure_sheet.shape(beam, way)
        line(single, 1e3 * aside, 1e3 * along, _COLOURS[k], f"{1e3 * way:g}")
    nearer = flexure_sheet.shape(beam, HALF_STROKE)[2]
    labels = ("sideways [mm]", "along the beam [mm]")
    key: Any = {"legend": "lower right", "title": "Δx/2 [mm]", "title_fontsize": 7.5}
    finish(single, "(a) one beam", *labels, **key)
    _guide(guide, beam)
    finish(guide, "(b) two in a row", "sideways [mm]")
    thick = [1e3 * flexure_sheet.max_thickness(beam, gf * GRAM_FORCE, 2e-3) for gf in LOADS]
    named = ((1e3 * CHOSEN, "chosen"), (thick[0], "most for 17.5 gf"), (thick[1], "most for 35 gf"))
    pull = np.linspace(0.5, 36.0, 72)
    for k, (t, name) in enumerate(named):
        bent = [flexure_sheet.deflection(beam, 1e-3 * t, gf * GRAM_FORCE) for gf in pull]
        line(load, pull, 1e3 * np.array(bent), _COLOURS[k], f"{t:.3f} mm, {name}")
    load.plot(LOADS, [1e3 * HALF_STROKE] * 2, "o", color=BLACK, markersize=5)
    load.axhline(1e3 * HALF_STROKE, color=BLACK, linewidth=0.8, linestyle=":")
    labels = ("load of the beam [gf]", "deflection [mm]")
    finish(load, "(c) one beam under load, (3.1)", *labels, legend="upper left")
    rate = flexure_sheet.stiffness(beam, CHOSEN)
    stress = flexure_sheet.bending_stress(beam, CHOSEN, HALF_STROKE)
    return caption(
        "3.6",
        figure,
        length=1e3 * beam.length,
        width=1e3 * beam.width,
        half_stroke=1e3 * HALF_STROKE,
        nearer=1e6 * nearer,
        thick=thick,
        chosen=1e3 * CHOSEN,
        rate=rate,
        pull=rate * STROKE / GRAM_FORCE,
        stroke=1e3 * STROKE,
        stress=1e-6 * stress,
    )


def _guide(ax: Any, beam: Beam) -> None:
    along, aside, _ = flexure_sheet.shape(beam, HALF_STROKE)
    length, rest = 1e3 * beam.length, np.zeros_like(along)
    first, second = (along, aside), (along[-1] - along, aside[-1] + aside)
    for row, base in enumerate((0.0, 9.0)):
        for side, colour, name in ((0.0, RED, "from the frame"), (1.2, BLUE, "to the platform")):
            straight = np.linspace(0.0, length, len(rest))
            line(ax, rest + base + side, straight, "0.7", "", linewidth=1.0)
            y, x = first if colour is RED else second
            label = name if row == 0 else ""
            line(ax, 1e3 * x + base + side, 1e3 * y, colour, label, linewidth=1.3)
        link = 1e3 * aside[-1] + base + np.array([0.0, 1.2])
        line(ax, link, np.full(2, 1e3 * along[-1]), BLACK, "", linewidth=2.0)
    platform = 2e3 * aside[-1] + 1.2 + np.array([-0.6, 9.6])
    line(ax, platform, np.full(2, -1.5), BLACK, "platform", linewidth=3.0)
    ax.set_ylim(-4.0, length + 21.0)
    ax.legend(fontsize=7.5, loc="upper left", frameon=False)


def flux(data: Sheets) -> Drawn:
    """Figure 3.7: flux of the magnets head-on, and of the bench's pair as it slides by."""
    sensor = data.sensor
    figure, axes = new(3.9, 1, 2)
    head, slide = axes[0]
    for m, colour in zip(magnets.TABLE_3_1, _COLOURS, strict=True):
        place, field = 1e3 * np.array(m.distance), np.array(m.flux)
        head.plot(place, field, ".-", color=colour, linewidth=0.9, label=m.name)
        best = magnets.largest_change(m, MILLIMETRE)
        ends = 1e3 * np.array([best.start, best.start + MILLIMETRE])
        head.plot(ends, np.interp(ends, place, field), color=colour, linewidth=3.5, alpha=0.5)
    finish(head, "(a) head-on, Table 3.1", "distance [mm]", "flux [G]", legend="best")
    x = sensor.centre + np.linspace(-2.3e-3, 2.3e-3, 461)
    field = gauss(sensor, x)
    end = 0.08 * INCH
    slopes = [end_slope(sensor, side * end) for side in (-1.0, 1.0)]
    line(slide, 1e3 * (x - sensor.centre), field, BLUE, "bench's magnets")
    for side, slope in zip((-1.0, 1.0), slopes, strict=True):
        at = side * end
        near = np.array([at - 0.6e-3, at + 0.6e-3])
        there = gauss(sensor, np.array([sensor.centre + at]))[0]
        for rate, colour, name in ((slope, RED, "slope there"), (SLOPE, ORANGE, "5000 G/in")):
            label = name if side < 0 else ""
            line(slide, 1e3 * near, there + rate * (near - at), colour, label, linestyle="--")
        slide.axvline(1e3 * at, color="0.5", linewidth=0.8, linestyle=":")
    labels = ("distance from the middle [mm]", "flux [G]")
    finish(slide, "(b) slide-by", *labels, legend="lower right")
    steep = min(slopes) * INCH
    return caption("3.7", figure, sensitivity=1e3 * SENSITIVITY, steep=steep)


def gauss(sensor: Hall, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Flux [G] at the bench's sensor at contractions `x` [m], by its sensitivity."""
    return np.array([(hall.volts(sensor, float(v), 0.0) - sensor.null) / SENSITIVITY for v in x])


def end_slope(sensor: Hall, place: float) -> float:
    """Slope [G/m] over the 0.2 mm inside of `place` [m], counted from the middle."""
    inside = place - np.copysign(0.2e-3, place)
    low, high = gauss(sensor, sensor.centre + np.array([inside, place]))
    return float((high - low) / (place - inside))


class Sheets(NamedTuple):
    claims: list[Claim]
    sensor: Hall


def collect(lab: Lab) -> Sheets:
    return Sheets(measure(), lab.settings.sensors.hall)


def claims(data: Sheets) -> list[Claim]:
    return data.claims


def _measure_sheets(data: Sheets) -> dict[str, Claim]:
    return {c.id: c for c in data.claims}


def budget(data: Sheets) -> Drawn:
    found = _measure_sheets(data)
    rows: list[tuple[str, ...]] = [
        (key, c.claim, f"{c.printed:g} {c.unit}", f"{c.measured:.4g} {c.unit}", c.reason)
        for key in BUDGET
        for c in (found[key],)
    ]
    return caption("Table 3.3", Grid(("claim", "figure", "printed", "computed", "remark"), rows))


def magnet_table(data: Sheets) -> Drawn:
    """Table 3.1: readings by distance, and the largest change over 1 mm."""
    claim = _measure_sheets(data)["D7"]
    sheets = magnets.TABLE_3_1
    flux = [{round(d / INCH, 4): f for d, f in zip(*m[1:], strict=True)} for m in sheets]
    places = sorted({d for sheet in flux for d in sheet})
    rows = [
        (f"{d:g} in", *(f"{sheet[d]:g}" if d in sheet else "" for sheet in flux)) for d in places
    ]
    assert isinstance(claim.measured, list)
    rows.append(("most over 1 mm, computed", *(f"{v:.0f}" for v in claim.measured)))
    rows.append(("most over 1 mm, printed", *(f"{v:g}" for v in printed_list("D7"))))
    return caption("Table 3.1", Grid(("distance", *(m.name for m in sheets)), rows), claim=claim)


def sensors(data: Sheets) -> Drawn:
    """Table 3.2, with the drawbacks of each sensor."""
    found = _measure_sheets(data)
    floor = found["D11"].measured
    assert isinstance(floor, float)
    needs = hall_sensors.Needs(sensitivity=1e-3 * floor)
    rows: list[tuple[str, ...]] = []
    for sensor, against in hall_sensors.judge(hall_sensors.TABLE_3_2, needs):
        field = "n/a" if sensor.field is None else f"±{sensor.field:g}"
        low, high = (f"{1e3 * s:g}" for s in sensor.sensitivity)
        span = low if low == high else f"{low}-{high}"
        verdict = "; ".join(against) or "meets both"
        rows.append((sensor.name, field, span, f"~{sensor.cost:g}", verdict))
    headings = ("sensor", "range [G]", "sensitivity [mV/G]", "cost [USD]", "judgement")
    return caption(
        "Table 3.2",
        Grid(headings, rows),
        field=needs.field,
        sensitivity=1e3 * needs.sensitivity,
        claim=found["D8"],
    )
