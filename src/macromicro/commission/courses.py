"""Open-loop effort profiles: ramps with short rests at their corners."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import SENSOR, Caution, CommissionError, Law, Record, Stand

QUIET = 0.5  # s without effort
_KEPT = 0.75  # amplitude of a swing over that of the one before


class Corner(NamedTuple):
    effort: float  # V
    rest: float  # s
    rate: float  # V/s; infinity for a step


def course(corners: Sequence[Corner], dt: float) -> Array:
    parts, at = [np.zeros(1)], 0.0
    for corner in corners:
        count = int(np.ceil(abs(corner.effort - at) / (corner.rate * dt)))
        parts.append(np.linspace(at, corner.effort, count + 1)[1:])
        parts.append(np.full(max(round(corner.rest / dt), 1), corner.effort))
        at = corner.effort
    return np.concatenate(parts)


def decaying(middle: float, amplitude: float, swings: int) -> list[float]:
    return [middle + amplitude * _KEPT**k * (-1.0) ** k for k in range(swings)]


def play(stand: Stand, efforts: Array, caution: Caution) -> Record:
    values = efforts.tolist()

    def law(t: float, x: float, v: float) -> float | None:
        k = round(t / stand.dt)
        return values[k] if k < len(values) else None

    return drive(stand, law, (len(values) + 1) * stand.dt, caution)


def quiet(stand: Stand, caution: Caution) -> Record:
    """What the stage shows without effort."""
    return _check_sensor(stand.drive(lambda t, x, v: 0.0, QUIET, caution))


def _check_sensor(record: Record) -> Record:
    """A record of a sensor that gave values to its end."""
    if record.ended == SENSOR:
        raise CommissionError("the sensor gives no value. Check its cable and supply")
    return record


def noise(record: Record) -> float:
    """Standard deviation of a reading about a straight line, m."""
    line = np.polynomial.Polynomial.fit(record.t, record.x, 1)
    return float(np.std(record.x - line(record.t)))


def drive(stand: Stand, law: Law, seconds: float, caution: Caution) -> Record:
    record = _check_sensor(stand.drive(law, seconds, caution))
    if record.ended:
        effort = record.u[-2] if len(record.u) > 1 else record.u[-1]  # before it was switched off
        where = stand.place.told(float(record.x[-1]), digits=4)
        raise CommissionError(
            f"the stage passed {record.ended} at {effort:.3g} V, {where}. "
            "Reduce --effort, or widen the limit"
        )
    return record
