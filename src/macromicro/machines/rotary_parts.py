"""Sets of settings of a rotary axis: motor, gear, load, encoder."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.control import cascade
from macromicro.machines import guarding, parts, sequence
from macromicro.machines.parts import LOAD, MARK, MOTOR, NONE, START, STOP, TURN
from macromicro.place import as_rotary
from macromicro.plant.friction import AxisFriction
from macromicro.plant.winding import WINDING, winding
from macromicro.schema.par import Par

STOPS = "stops"
_MOTOR = "motor's data sheet"
_GEAR = "gear's data sheet"
_SHEET = "data sheet or drawing"
_MEASURED = "data sheet or measurement"
_DERIVED = "derived from the data sheets"


class Motor(NamedTuple):
    """A brushed or commutated brushless motor, as seen at its terminals."""

    constant: Annotated[
        float, Par("N*m/A", "torque constant, also that of the back-EMF", _MOTOR, positive=True)
    ] = 0.0302
    resistance: Annotated[float, Par("ohm", "resistance", _MOTOR, positive=True)] = 1.2
    inductance: Annotated[float, Par("H", "inductance", _MOTOR, shown="mH", positive=True)] = (
        0.24e-3
    )
    inertia: Annotated[float, Par("kg*m^2", "inertia of the rotor", _MOTOR, lo=0.0)] = 1.4e-6

    def figures(self) -> dict[str, Par]:
        return WINDING

    def of_figures(self, given: dict[str, float], where: str) -> dict[str, float]:
        return winding(given, where)


class Gear(NamedTuple):
    ratio: Annotated[
        float,
        Par("1", "turns of the motor per turn of the load; 1: direct drive", _GEAR, positive=True),
    ] = 10.0
    inertia: Annotated[
        float, Par("kg*m^2", "inertia turning with the motor: gear, coupling", _GEAR, lo=0.0)
    ] = 1.0e-6
    efficiency: Annotated[
        float, Par("1", "efficiency (share of the motor's torque)", _GEAR, lo=0.05, hi=1.0)
    ] = 1.0
    frequency: Annotated[
        float,
        Par(
            "Hz",
            "torsional mode of the load on gear and shaft, motor held; 0: stiff",
            _MEASURED,
            lo=0.0,
        ),
    ] = 0.0
    damping: Annotated[float, Par("1", "damping ratio of that mode", _MEASURED, lo=0.0, hi=2.0)] = (
        0.02
    )
    backlash: Annotated[
        float,
        Par("rad", "backlash between motor and load, at the load", _GEAR, shown="deg", lo=0.0),
    ] = 0.0
    error: Annotated[
        float, Par("rad", "amplitude of the gear's error", _GEAR, shown="mdeg", lo=0.0)
    ] = 0.0
    error_period: Annotated[
        float, Par("rad", "its period along the turn", _GEAR, shown="deg", positive=True)
    ] = 0.6283185307179586
    cogging: Annotated[
        float, Par("N*m", "amplitude of the motor's cogging, at the load", _MEASURED, lo=0.0)
    ] = 0.0
    cogging_period: Annotated[
        float, Par("rad", "its period along the turn", _MEASURED, shown="deg", positive=True)
    ] = 0.08726646259971647

    @property
    def kind(self) -> str:
        return "gear"


class Turntable(NamedTuple):
    """The rotary load and its end stops."""

    inertia: Annotated[
        float, Par("kg*m^2", "inertia of the load, without payload and gear", _SHEET, positive=True)
    ] = 0.01
    payload: Annotated[float, Par("kg*m^2", "inertia of the payload", _SHEET, lo=0.0)] = 0.0
    ends: Annotated[
        str,
        Par(
            "",
            "stops, or none: continuous rotation with a multi-turn position",
            _SHEET,
            choices=(STOPS, NONE),
        ),
    ] = STOPS
    stop_low: Annotated[
        float, Par("rad", "lower end stop", _SHEET, shown="deg", hi=0.0)
    ] = -0.08726646259971647
    stop_high: Annotated[
        float, Par("rad", "upper end stop", _SHEET, shown="deg", positive=True)
    ] = 4.799655442984406
    stop_stiffness: Annotated[
        float,
        Par("N*m/rad", "stiffness of the end stops", _MEASURED, positive=True),
    ] = 500.0
    stop_damping: Annotated[
        float, Par("N*m*s/rad", "damping of the end stops", _MEASURED, lo=0.0)
    ] = 0.5
    unbalance: Annotated[
        float,
        Par(
            "N*m",
            "greatest torque of gravity on an eccentric load: its weight times its distance from "
            "a horizontal shaft",
            _SHEET,
            lo=0.0,
        ),
    ] = 0.0
    hangs: Annotated[float, Par("rad", "angle at which such a load hangs", _SHEET, shown="deg")] = (
        0.0
    )

    @property
    def mass(self) -> float:
        return self.inertia  # as the rules of an axis read it

    @property
    def incline(self) -> float:
        return 0.0  # gravity acts on an eccentric load alone

    @property
    def endless(self) -> bool:
        return self.ends == NONE

    def times(self, factor: float) -> Turntable:
        return self._replace(inertia=factor * self.inertia, payload=factor * self.payload)


class Feedback(NamedTuple):
    at: Annotated[
        str, Par("", "where it sits: on the motor or at the load", _SHEET, choices=(MOTOR, LOAD))
    ] = MOTOR
    counts: Annotated[
        float,
        Par("1", "counts per turn of what it sits on: four a line", _SHEET, positive=True),
    ] = 4000.0
    pitch: Annotated[
        float, Par("rad", "turn of the load per count", _DERIVED, shown="deg", positive=True)
    ] = 1.0e-4
    noise: Annotated[
        float, Par("rad", "noise before counting, rms, at the load", _SHEET, shown="mdeg", lo=0.0)
    ] = 0.0
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
    index_place: Annotated[float, Par("rad", "where an index pulse is", _DERIVED, shown="deg")] = (
        0.0
    )


@as_rotary
class Friction(AxisFriction):
    """Total friction as a torque at the load."""

    __slots__ = ()


@as_rotary
class Travel(parts.Travel):
    """Targets of programmes lie between these."""

    __slots__ = ()


@as_rotary
class Motion(parts.Motion):
    """Limits of the moves' profiles."""

    __slots__ = ()


@as_rotary
class Arrival(sequence.Arrival):
    __slots__ = ()


@as_rotary
class Limits(guarding.Limits):
    __slots__ = ()


@as_rotary
class Cascade(cascade.Cascade):
    __slots__ = ()


@as_rotary
class Switches(parts.Switches):
    """Limit and home switches."""

    __slots__ = ()


class Homing(NamedTuple):
    on: Annotated[
        str,
        Par(
            "",
            "as of `axis`; start, of an axis without ends: where it is switched on is 0",
            _DERIVED,
            choices=(*parts.HOMING, START),
        ),
    ] = STOP


SWITCHES = Switches(hysteresis=8.726646259971648e-04, repeatability=8.726646259971648e-05)
FRICTION = Friction(
    coulomb=0.05,
    stribeck=0.01,
    stribeck_speed=0.017453292519943295,
    viscous=0.005,
    presliding=8.726646259971648e-05,
    ripple_long=1.5707963267948966,
    ripple_short=0.4363323129985824,
)
