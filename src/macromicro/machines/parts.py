"""Sets of settings that machines share."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.schema.par import Par

MOTOR, LOAD = "motor", "load"
NONE, TURN, MARK = "none", "turn", "mark"
LOW, HIGH, BOTH = "low", "high", "both"
CLOSED, OPEN = "closed", "open"
BELOW, CAM = "below", "cam"
STOP, LOW_LIMIT, HOME, INDEX, START = "stop", "limit", "home", "index", "start"
HOMING = (STOP, LOW_LIMIT, HOME, f"{LOW_LIMIT}+{INDEX}", f"{HOME}+{INDEX}", INDEX)
_SHEET = "data sheet or drawing"
_MEASURED = "data sheet or measurement"
_DERIVED = "derived from the data sheets"
_CHOICE = "machine choice"


class Load(NamedTuple):
    """Mass, slope and end stops."""

    mass: Annotated[
        float, Par("kg", "moving mass without payload, at the load", _SHEET, positive=True)
    ] = 0.5
    payload: Annotated[float, Par("kg", "payload", _SHEET, lo=0.0)] = 0.0
    incline: Annotated[
        float,
        Par(
            "rad",
            "slope of the travel, upwards to higher positions: 90 deg is vertical",
            _SHEET,
            shown="deg",
            lo=-math.pi / 2.0,
            hi=math.pi / 2.0,
        ),
    ] = 0.0
    stop_low: Annotated[float, Par("m", "lower end stop", _SHEET, shown="mm", hi=0.0)] = -5.0e-3
    stop_high: Annotated[float, Par("m", "upper end stop", _SHEET, shown="mm", positive=True)] = (
        305.0e-3
    )
    stop_stiffness: Annotated[
        float, Par("N/m", "stiffness of the end stops", _MEASURED, shown="N/mm", positive=True)
    ] = 1.0e5
    stop_damping: Annotated[float, Par("N*s/m", "damping of the end stops", _MEASURED, lo=0.0)] = (
        100.0
    )

    def times(self, factor: float) -> Load:
        return self._replace(mass=factor * self.mass, payload=factor * self.payload)


class Feedback(NamedTuple):
    at: Annotated[
        str, Par("", "where it sits: on the motor or at the load", _SHEET, choices=(MOTOR, LOAD))
    ] = MOTOR
    lines: Annotated[
        float, Par("1", "lines per turn (encoder on a motor that turns)", _SHEET, positive=True)
    ] = 1000.0
    pitch: Annotated[
        float, Par("m", "travel of the load per count", _DERIVED, shown="um", positive=True)
    ] = 1.0e-6
    noise: Annotated[float, Par("m", "noise before counting, rms", _SHEET, shown="um", lo=0.0)] = (
        0.0
    )
    bits: Annotated[float, Par("", "width of the counter", _SHEET, lo=8, hi=48)] = 32.0
    rate: Annotated[
        float, Par("counts/s", "fastest counting of encoder and counter", _SHEET, positive=True)
    ] = 4.0e6
    index_pulse: Annotated[
        str,
        Par(
            "",
            "none, turn (one per turn of the motor) or mark (one on the way)",
            _SHEET,
            choices=(NONE, TURN, MARK),
        ),
    ] = NONE
    index_place: Annotated[float, Par("m", "where an index pulse is", _DERIVED, shown="mm")] = 0.0

    def figures(self) -> dict[str, Par]:
        return {"counts": Par("1", "counts per turn, four a line", _SHEET, positive=True)}

    def of_figures(self, given: dict[str, float], where: str) -> dict[str, float]:
        return {"lines": given["counts"] / 4.0}


class Switches(NamedTuple):
    """Limit and home switches."""

    limits: Annotated[
        str,
        Par("", "limit switches: none, low, high or both", _SHEET, choices=(NONE, LOW, HIGH, BOTH)),
    ] = NONE
    low: Annotated[
        float, Par("m", "the lower one trips at or below this place", _DERIVED, shown="mm")
    ] = -2.0e-3
    high: Annotated[
        float, Par("m", "the upper one trips at or above this place", _DERIVED, shown="mm")
    ] = 302.0e-3
    contacts: Annotated[
        str,
        Par(
            "",
            "of the limit switches: closed (opens to trip, so that a cut wire trips) or open",
            _SHEET,
            choices=(CLOSED, OPEN),
        ),
    ] = CLOSED
    home: Annotated[
        str,
        Par(
            "",
            "home switch: none, below (on at and below its place) or cam (on over its width)",
            _SHEET,
            choices=(NONE, BELOW, CAM),
        ),
    ] = NONE
    home_place: Annotated[
        float, Par("m", "upper edge of the home switch", _DERIVED, shown="mm")
    ] = 20.0e-3
    home_width: Annotated[
        float, Par("m", "length of the cam", _DERIVED, shown="mm", positive=True)
    ] = 6.0e-3
    hysteresis: Annotated[
        float, Par("m", "hysteresis of the switch", _SHEET, shown="um", lo=0.0)
    ] = 50.0e-6
    repeatability: Annotated[
        float,
        Par("m", "scatter of the place where it trips, rms", _SHEET, shown="um", lo=0.0),
    ] = 5.0e-6
    leave: Annotated[
        float,
        Par("m/s", "greatest speed off a tripped limit switch", _DERIVED, positive=True),
    ] = 0.1


class Homing(NamedTuple):
    on: Annotated[
        str,
        Par(
            "",
            "stop, limit, home, index (a mark), or limit or home with the next index pulse above",
            _CHOICE,
            choices=HOMING,
        ),
    ] = STOP


class Timing(NamedTuple):
    period: Annotated[float, Par("s", "control period", _CHOICE, shown="ms", lo=1e-5, hi=0.1)] = (
        1e-3
    )
    delay: Annotated[
        float, Par("s", "delay from a reading to its effort", _SHEET, shown="ms", lo=0.0)
    ] = 0.1e-3
    steps: Annotated[
        int, Par("", "steps of the physics per control period", _DERIVED, lo=1, hi=20000)
    ] = 20


class Travel(NamedTuple):
    """Targets of programmes lie between these."""

    low: Annotated[float, Par("m", "lowest target", _DERIVED, shown="mm")] = 0.0
    high: Annotated[float, Par("m", "highest target", _DERIVED, shown="mm")] = 0.3


class Motion(NamedTuple):
    """Limits of the moves' profiles."""

    velocity: Annotated[float, Par("m/s", "maximum speed", _DERIVED, positive=True)] = 1.0
    acceleration: Annotated[
        float, Par("m/s^2", "maximum acceleration", _DERIVED, positive=True)
    ] = 10.0
    jerk: Annotated[float, Par("m/s^3", "maximum jerk", _DERIVED, positive=True)] = 1000.0
