"""Design of flexure, magnets and sensor (Sections 3.2.2, 3.2.3): Figures 3.6 and 3.7, Tables
3.1 and 3.2, claims D1-D5, D7, D8 and D11."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from macromicro.design import hall_sensors, magnets
from macromicro.design.magnets import INCH
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.experiments import sensor_design
from macromicro.experiments.claim import Claim
from macromicro.experiments.procedure import Lab, Procedure
from macromicro.experiments.procedures import _sensor_figures
from macromicro.experiments.sensor_design import FLUX_CHANGES
from macromicro.plant.hall import Hall

BUDGET = ("D2", "D3", "D4", "D5", "D11")


class Sheets(NamedTuple):
    """The claims, and the bench's sensor with its magnets."""

    claims: list[Claim]
    sensor: Hall


def collect(lab: Lab) -> Sheets:
    """Work out the design sheets."""
    return Sheets(sensor_design.claims(), lab.settings.sensors.hall)


def claims(data: Sheets) -> list[Claim]:
    """D1-D5, D7, D8 and D11."""
    return data.claims


def draw(data: Sheets) -> Iterator[Drawn]:
    """Figures 3.6 and 3.7, Tables 3.1 and 3.2, and the budget of Section 3.2.3."""
    found = {c.id: c for c in data.claims}
    yield _sensor_figures.flexure()
    yield _magnets(found["D7"])
    yield _sensor_figures.flux(data.sensor)
    yield _sensors(found)
    rows: list[tuple[str, ...]] = [
        (key, c.claim, f"{c.printed:g} {c.unit}", f"{c.measured:.4g} {c.unit}", c.reason)
        for key in BUDGET
        for c in (found[key],)
    ]
    yield Drawn(
        "Table 3.3",
        "Resolution budget of Section 3.2.3 (ours)",
        "The thesis gives these figures in its text. From the converter's step over the sensor's "
        "sensitivity to the travel that one bit is worth where the flux changes least.",
        Grid(("claim", "figure", "printed", "computed", "remark"), rows),
        BUDGET,
    )


def _magnets(claim: Claim) -> Drawn:
    """Table 3.1: readings by distance, and the largest change over 1 mm."""
    sheets = magnets.TABLE_3_1
    flux = [{round(d / INCH, 4): f for d, f in zip(*m[1:], strict=True)} for m in sheets]
    places = sorted({d for sheet in flux for d in sheet})
    rows = [
        (f"{d:g} in", *(f"{sheet[d]:g}" if d in sheet else "" for sheet in flux)) for d in places
    ]
    assert isinstance(claim.measured, list)
    rows.append(("most over 1 mm, computed", *(f"{v:.0f}" for v in claim.measured)))
    rows.append(("most over 1 mm, printed", *(f"{v:g}" for v in FLUX_CHANGES)))
    return Drawn(
        "Table 3.1",
        "Flux of seven magnets, head-on",
        "Flux [G] at a distance [in], by the maker's curves as the thesis reads them. The last but "
        "one row is worked out from the readings, straight lines in between. " + claim.reason,
        Grid(("distance", *(m.name for m in sheets)), rows),
        ("D7",),
    )


def _sensors(found: dict[str, Claim]) -> Drawn:
    """Table 3.2, with what speaks against each sensor."""
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
    return Drawn(
        "Table 3.2",
        "Hall effect sensors",
        f"Needed: a range over {needs.field:g} G and {1e3 * needs.sensitivity:.2f} mV/G. "
        + found["D8"].reason,
        Grid(("sensor", "range [G]", "sensitivity [mV/G]", "cost [USD]", "judgement"), rows),
        ("D8",),
    )


PROCEDURE = Procedure(
    name="sensor-design",
    title="Design of the flexure and of the position sensor",
    sections=("3.2.2", "3.2.3"),
    channels=(),
    ids=("D1", "D2", "D3", "D4", "D5", "D7", "D8", "D11"),
    figures=("3.6", "Table 3.1", "3.7", "Table 3.2", "Table 3.3"),
    diagrams=(),
    seconds=0.5,
    collect=collect,
    claims=claims,
    draw=draw,
)
