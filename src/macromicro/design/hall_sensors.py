"""Choice of the Hall sensor (Section 3.2.3, Table 3.2): which ones meet the requirements?

Field in gauss, sensitivity in V/G, cost in US dollars.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from macromicro.design.checks import positive, sheet
from macromicro.errors import InputError


class Sensor(NamedTuple):
    """A data sheet.

    Attributes
    ----------
    name : str
        Name of the sensor.
    field : float | None
        Greatest field of either sign, G; None where it follows from a sensitivity that can be
        programmed.
    sensitivity : tuple[float, float]
        Least and greatest, V/G.
    cost : float
        USD.
    """

    name: str
    field: float | None
    sensitivity: tuple[float, float]
    cost: float


class Needs(NamedTuple):
    """What is required.

    Attributes
    ----------
    field : float
        The range must exceed it, G.
    sensitivity : float
        At least that, V/G (see `resolution.sensitivity_floor`).
    cost : float | None
        Below that, USD; None for any.
    """

    field: float = 650.0
    sensitivity: float = 3.0e-3
    cost: float | None = None


class Verdict(NamedTuple):
    """A sensor and what speaks against it; nothing does when `against` is empty."""

    sensor: Sensor
    against: tuple[str, ...]


def judge(sensors: Sequence[Sensor], needs: Needs) -> list[Verdict]:
    """Every sensor with the requirements that it misses (Table 3.2).

    The table prints no supply or output voltage, so the requirement of the converter's input range
    cannot be judged.

    Parameters
    ----------
    sensors : Sequence[Sensor]
        Data sheets.
    needs : Needs
        Requirements.

    Returns
    -------
    list[Verdict]
        One per sensor, in their order.

    Raises
    ------
    InputError
        Impossible numbers, or what is no `Sensor` or no `Needs`.
    """
    sheet("Hall sensor, needs", needs, Needs)
    positive("Hall sensor, field", needs.field, "G")
    positive("Hall sensor, sensitivity", needs.sensitivity, "V/G")
    if needs.cost is not None:
        positive("Hall sensor, cost", needs.cost, "USD")
    return [Verdict(s, tuple(_against(s, needs))) for s in sensors]


def suitable(sensors: Sequence[Sensor], needs: Needs) -> list[Sensor]:
    """The sensors that miss nothing, the cheapest first, otherwise in the order given.

    Parameters
    ----------
    sensors : Sequence[Sensor]
        Data sheets.
    needs : Needs
        Requirements.

    Returns
    -------
    list[Sensor]
        Some of `sensors`.

    Raises
    ------
    InputError
        As for `judge`.
    """
    found = [v.sensor for v in judge(sensors, needs) if not v.against]
    return sorted(found, key=lambda s: s.cost)


def _against(sensor: Sensor, needs: Needs) -> list[str]:
    sheet("Hall sensor", sensor, Sensor)
    low, high = sensor.sensitivity
    positive(f"Hall sensor {sensor.name}, sensitivity", low, "V/G")
    positive(f"Hall sensor {sensor.name}, cost", sensor.cost, "USD")
    if high < low:
        raise InputError(
            f"Hall sensor {sensor.name}, sensitivity", sensor.sensitivity, "least, greatest"
        )
    missed = []
    if sensor.field is not None:
        positive(f"Hall sensor {sensor.name}, field", sensor.field, "G")
        if sensor.field <= needs.field:
            missed.append(f"range {sensor.field:g} G, needs over {needs.field:g} G")
    if high < needs.sensitivity:
        missed.append(f"{1e3 * high:g} mV/G, needs {1e3 * needs.sensitivity:g} mV/G")
    if needs.cost is not None and sensor.cost >= needs.cost:
        missed.append(f"{sensor.cost:g} USD, needs below {needs.cost:g} USD")
    return missed


# Table 3.2; its costs are marked as approximate.
TABLE_3_2 = (
    Sensor("SS495A", 670.0, (3.125e-3, 3.125e-3), 10.0),
    Sensor("SS495A1", 670.0, (3.125e-3, 3.125e-3), 10.0),
    Sensor("SS495A2", 670.0, (3.125e-3, 3.125e-3), 10.0),
    Sensor("SS496A", 840.0, (2.5e-3, 2.5e-3), 10.0),
    Sensor("SS94A1B", 500.0, (1.875e-3, 1.875e-3), 10.0),
    Sensor("SS94B1", 670.0, (3.125e-3, 3.125e-3), 10.0),
    Sensor("90215", None, (0.5e-3, 14e-3), 100.0),
)
