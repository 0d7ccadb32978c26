"""Courses of effort that are played as they are: ramps with short rests at their corners."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import Caution, CommissionError, Law, Record, Stand

_KEPT = 0.75  # amplitude of a swing over that of the one before


class Corner(NamedTuple):
    """Where a course goes next.

    Attributes
    ----------
    effort : float
        V.
    rest : float
        How long it stays there, s.
    rate : float
        How fast it goes there, V/s; infinity for a step.
    """

    effort: float
    rest: float
    rate: float


def course(corners: Sequence[Corner], dt: float) -> Array:
    """Efforts from 0 through all corners.

    Parameters
    ----------
    corners : Sequence[Corner]
        In their order.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray, shape (n,)
        V, one a period.
    """
    parts, at = [np.zeros(1)], 0.0
    for corner in corners:
        count = int(np.ceil(abs(corner.effort - at) / (corner.rate * dt)))
        parts.append(np.linspace(at, corner.effort, count + 1)[1:])
        parts.append(np.full(max(round(corner.rest / dt), 1), corner.effort))
        at = corner.effort
    return np.concatenate(parts)


def decaying(middle: float, amplitude: float, swings: int) -> list[float]:
    """Turning points of a swing that dies away.

    Parameters
    ----------
    middle : float
        About which it swings, V.
    amplitude : float
        Of the first turning point, V.
    swings : int
        How many turning points.

    Returns
    -------
    list[float]
        V.
    """
    return [middle + amplitude * _KEPT**k * (-1.0) ** k for k in range(swings)]


def played(stand: Stand, efforts: Array, caution: Caution) -> Record:
    """Give efforts one after the other; they should end near 0, where the drive ends.

    Parameters
    ----------
    stand : Stand
        The stage.
    efforts : ndarray, shape (n,)
        V.
    caution : Caution
        What may not be passed.

    Returns
    -------
    Record
        A row per period.

    Raises
    ------
    CommissionError
        A limit was passed; says which.
    """
    values = efforts.tolist()

    def law(t: float, x: float, v: float) -> float | None:
        k = round(t / stand.dt)
        return values[k] if k < len(values) else None

    return driven(stand, law, (len(values) + 1) * stand.dt, caution)


def driven(stand: Stand, law: Law, seconds: float, caution: Caution) -> Record:
    """Let a law drive a stage, which must not pass a limit.

    Parameters
    ----------
    stand : Stand
        The stage.
    law : Law
        Should end near 0, where the drive ends.
    seconds : float
        At most so long, s.
    caution : Caution
        What may not be passed.

    Returns
    -------
    Record
        A row per period.

    Raises
    ------
    CommissionError
        A limit was passed; says which.
    """
    record = stand.drive(law, seconds, caution)
    if record.ended:
        raise CommissionError(
            f"it passed {record.ended} at {record.u[-2]:.3g} V, {record.x[-1] * 1e3:.4g} mm: name "
            "a smaller --effort, or a wider limit"
        )
    return record
