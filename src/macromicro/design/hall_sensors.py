"""Choice of the Hall sensor (Section 3.2.3, Table 3.2).

Field in gauss, sensitivity in V/G, cost in US dollars.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from macromicro.design._checks import DATA, positive, sheet
from macromicro.errors import InputError


class Sensor(NamedTuple):
    """A data sheet.

    Examples
    --------
    >>> from macromicro.design import Needs, Sensor, judge
    >>> weak = Sensor("weak", field=500.0, sensitivity=(5e-3, 5e-3), cost=1.0)
    >>> judge([weak], Needs(field=450.0))[0].against
    ()
    """

    name: str  #: name of the sensor
    #: greatest field of either sign, G; None where it follows from a sensitivity that can be
    #: programmed
    field: float | None
    sensitivity: tuple[float, float]  #: least and greatest, V/G
    cost: float  #: USD


class Needs(NamedTuple):
    """What is required.

    Examples
    --------
    >>> from macromicro.design import Needs, suitable
    >>> from macromicro.design.hall_sensors import TABLE_3_2
    >>> [each.name for each in suitable(TABLE_3_2, Needs())]
    ['SS495A', 'SS495A1', 'SS495A2', 'SS94B1', '90215']
    """

    field: float = 650.0  #: the range must exceed it, G
    sensitivity: float = 3.0e-3  #: at least that, V/G (see `resolution.sensitivity_floor`)
    cost: float | None = None  #: below that, USD; None for any


class Verdict(NamedTuple):
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
        Impossible numbers, or an argument that is not a `Sensor` or not `Needs`.

    Examples
    --------
    >>> from macromicro.design import Needs, Sensor, judge
    >>> weak = Sensor("weak", field=500.0, sensitivity=(5e-3, 5e-3), cost=1.0)
    >>> judge([weak], Needs(field=650.0))[0].against
    ('range 500 G, needs over 650 G',)
    """
    sheet("Hall sensor, needs", needs, Needs)
    positive("Hall sensor, field", needs.field, "G")
    positive("Hall sensor, sensitivity", needs.sensitivity, "V/G")
    if needs.cost is not None:
        positive("Hall sensor, cost", needs.cost, "USD")
    return [Verdict(s, tuple(_against(s, needs))) for s in sensors]


def suitable(sensors: Sequence[Sensor], needs: Needs) -> list[Sensor]:
    """The sensors that meet all requirements, the cheapest first.

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

    Examples
    --------
    >>> from macromicro.design import Needs, Sensor, suitable
    >>> weak = Sensor("weak", field=500.0, sensitivity=(5e-3, 5e-3), cost=1.0)
    >>> strong = Sensor("strong", field=1000.0, sensitivity=(4e-3, 4e-3), cost=2.0)
    >>> [each.name for each in suitable([weak, strong], Needs(field=650.0))]
    ['strong']
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


TABLE_3_2 = tuple(
    Sensor(name, row.get("field"), tuple(row["sensitivity"]), row["cost"])
    for name, row in DATA["sensors"].items()
)
