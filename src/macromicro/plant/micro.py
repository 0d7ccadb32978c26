"""The micro-stage: driver, heat ladder and wires on their load, one control period at a time."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.hysteresis import Everett, fresh
from macromicro.kernel import kernel
from macromicro.plant import driver, thermal, wire
from macromicro.plant.driver import Driver, DriverTable
from macromicro.plant.phase import Phase
from macromicro.plant.phase import table as phase_table
from macromicro.plant.thermal import Thermal
from macromicro.plant.wire import Load, Wire, WireState


class Micro(NamedTuple):
    """Parameters of an electrically heated actuator and its load."""

    driver: DriverTable
    thermal: Thermal
    wire: Wire
    table: Everett
    load: Load


class MicroState(NamedTuple):
    """State of the micro-stage.

    Attributes
    ----------
    power : float
        Heat into the wires, W.
    flow : float
        Heat from wires to plates at the last step's start, W.
    cut : float
        CONTRACT closed, 0 or 1.
    plates : float
        deg C.
    body : float
        deg C.
    wire : WireState
        The wires.
    """

    power: float
    flow: float
    cut: float
    plates: float
    body: float
    wire: WireState


def prepare(spec: Driver, heat: Thermal, alloy: Wire, phase: Phase, load: Load) -> Micro:
    """Runtime parameters, the relay table included.

    Parameters
    ----------
    spec : Driver
        Driver circuit.
    heat : Thermal
        Heat ladder.
    alloy : Wire
        Wires.
    phase : Phase
        Density of the relays.
    load : Load
        What the wires pull.

    Returns
    -------
    Micro
        For the kernels.
    """
    return Micro(driver.prepare(spec), heat, alloy, phase_table(phase), load)


def cold(p: Micro, temperature: float) -> MicroState:
    """The actuator at a temperature, fully extended, never heated before.

    Parameters
    ----------
    p : Micro
        Parameters of the actuator.
    temperature : float
        Temperature, deg C.

    Returns
    -------
    MicroState
        Its memory is its own.
    """
    return MicroState(
        0.0,
        0.0,
        0.0,
        float(temperature),
        float(temperature),
        cold_wire(p.wire, p.load, p.table, temperature),
    )


def cold_wire(p: Wire, load: Load, table: Everett, temperature: float) -> WireState:
    """Wires at rest at a temperature, all martensite.

    Parameters
    ----------
    p : Wire
        Parameters of the actuator.
    load : Load
        What they pull.
    table : Everett
        Relays.
    temperature : float
        Temperature, deg C.

    Returns
    -------
    WireState
        Its memory is its own.
    """
    u = temperature - p.shift * (load.preload - p.reference_load)
    return WireState(float(temperature), u, 1.0, 0.0, 0.0, float(temperature), fresh(table, u))


@kernel
def advance(
    p: Micro, s: MicroState, ctrl: float, fan: float, inertia: float, dt: float
) -> MicroState:
    """The actuator after one step.

    Parameters
    ----------
    p : Micro
        Parameters of the actuator.
    s : MicroState
        State of the actuator; its memory is changed in place.
    ctrl : float
        CTRL, D/A volts, V.
    fan : float
        0 or 1.
    inertia : float
        Load by the carriage's acceleration, N.
    dt : float
        Length of the step, s.

    Returns
    -------
    MicroState
        New state.
    """
    cut = driver.contract(p.driver, s.cut, s.wire.x)
    power = driver.delivered(p.driver, s.power, ctrl, cut, dt)
    now, f2, f3 = thermal.flows(p.thermal, s.wire.temperature, s.plates, s.body, fan)
    # Second order in dt: mean power, and the flow at mid-step (Adams-Bashforth).
    f1 = 1.5 * now - 0.5 * s.flow
    gain = (0.5 * (s.power + power) - f1) * dt
    alloy = wire.heated(p.wire, p.load, p.table, s.wire, gain, inertia, p.thermal.wire_capacity)
    plates = s.plates + (f1 - f2) * dt / p.thermal.plate_capacity
    body = s.body + (f2 - f3) * dt / p.thermal.body_capacity
    return MicroState(power, now, cut, plates, body, alloy)
