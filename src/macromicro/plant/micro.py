"""The micro-stage: driver, heat ladder and wires on their load, one control period at a time."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.hysteresis import Everett, fresh
from macromicro.kernel import kernel
from macromicro.plant import creep, driver, thermal, wire
from macromicro.plant.creep import Creep, CreepTable
from macromicro.plant.driver import Driver, DriverTable
from macromicro.plant.phase import Phase
from macromicro.plant.phase import table as phase_table
from macromicro.plant.thermal import Thermal
from macromicro.plant.wire import Load, Wire, WireState

_DECADES = 3  # of time, over which the wires creep


class Micro(NamedTuple):
    """Parameters of an electrically heated actuator and its load."""

    driver: DriverTable
    thermal: Thermal
    wire: Wire
    table: Everett
    load: Load
    creep: CreepTable


class MicroState(NamedTuple):
    """State of the micro-stage."""

    power: Annotated[float, Meaning("heat into the wires", "W")]
    flow: Annotated[float, Meaning("heat from wires to plates at the last step's start", "W")]
    cut: Annotated[float, Meaning("CONTRACT closed, 0 or 1")]
    plates: Annotated[float, Meaning("", "degC")]
    body: Annotated[float, Meaning("", "degC")]
    wire: Annotated[
        WireState,
        Meaning("the wires; of unequal ones, the half that sheds more heat"),
    ]
    other: Annotated[WireState, Meaning("the other half of unequal wires, else unused")]
    lags: Annotated[Array, Meaning("what creeps", "m")]
    t: Annotated[float, Meaning("since the beginning", "s")]


def prepare(spec: Driver, heat: Thermal, alloy: Wire, phase: Phase, load: Load) -> Micro:
    """Runtime parameters, the relay table included."""
    late = creep.prepare(Creep(alloy.creep, alloy.creep_first, _DECADES))
    return Micro(driver.prepare(spec), heat, alloy, phase_table(phase), load, late)


def cold(p: Micro, temperature: float) -> MicroState:
    """The actuator at a temperature (deg C), fully extended, never heated before."""
    return MicroState(
        0.0,
        0.0,
        0.0,
        float(temperature),
        float(temperature),
        cold_wire(p.wire, p.load, p.table, temperature),
        cold_wire(p.wire, p.load, p.table, temperature),
        creep.fresh(p.creep),
        0.0,
    )


def cold_wire(p: Wire, load: Load, table: Everett, temperature: float) -> WireState:
    """Wires at rest at a temperature (deg C), all martensite."""
    u = temperature - p.shift * (load.preload - p.reference_load)
    return WireState(float(temperature), u, 1.0, 0.0, 0.0, float(temperature), fresh(table, u))


@kernel
def _halves(
    p: Micro, s: MicroState, first: float, second: float, inertia: float
) -> tuple[WireState, WireState, float]:
    """Both halves of unequal wires in series after gains of heat [J], and their contraction [m]."""
    capacity = p.thermal.wire_capacity
    apart = 0.5 * p.load.rate * p.wire.stroke * (s.other.austenite - s.wire.austenite)
    a = wire.heated(p.wire, p.load, p.table, s.wire, first, inertia + apart, capacity)
    b = wire.heated(p.wire, p.load, p.table, s.other, second, inertia - apart, capacity)
    return a, b, 0.5 * (a.x + b.x)


@kernel
def advance(
    p: Micro, s: MicroState, ctrl: float, fan: float, inertia: float, dt: float
) -> MicroState:
    """The actuator after one step."""
    cut = driver.contract(p.driver, s.cut, s.wire.x)
    power = driver.delivered(p.driver, s.power, ctrl, cut, dt)
    air = thermal.airy(p.thermal, s.t)
    now, f2, f3 = thermal.flows(p.thermal, s.wire.temperature, s.plates, s.body, fan, air)
    uneven = p.wire.unequal
    first, second = now, now
    if uneven > 0.0:  # what each half would shed, were all wires like it
        first = (1.0 + uneven) * now
        second = (1.0 - uneven) * thermal.to_plates(p.thermal, s.other.temperature, s.plates)
        now = 0.5 * (first + second)
    # Second order in dt: mean power, and the flow at mid-step (Adams-Bashforth).
    f1 = 1.5 * now - 0.5 * s.flow
    heat = 0.5 * (s.power + power)
    if uneven > 0.0:
        alloy, other, x = _halves(p, s, (heat - first) * dt, (heat - second) * dt, inertia)
    else:
        capacity = p.thermal.wire_capacity
        gain = (heat - f1) * dt
        alloy = wire.heated(p.wire, p.load, p.table, s.wire, gain, inertia, capacity)
        other, x = s.other, alloy.x
    if p.creep.share > 0.0:
        x = min(creep.advance(p.creep, s.lags, x, dt), p.wire.stop)
    alloy = wire.placed(alloy, x)
    plates = s.plates + (f1 - f2) * dt / p.thermal.plate_capacity
    body = s.body + (f2 - f3) * dt / p.thermal.body_capacity
    return MicroState(power, now, cut, plates, body, alloy, other, s.lags, s.t + dt)
