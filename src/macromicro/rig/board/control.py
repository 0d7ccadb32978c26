"""One control period of the board: laws, guard and what silence of the host does.

The firmware runs the C that is exported from it (`macromicro export c two_stage.board --float`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.control import calibration, deadzone, pd, pi
from macromicro.control.calibration import Calibration
from macromicro.control.pd import PdTuned
from macromicro.control.pi import PiAntiWindup
from macromicro.kernel import kernel
from macromicro.rig import guard
from macromicro.rig.board.protocol import SPEC, TABLE
from macromicro.rig.codes import OK
from macromicro.rig.guard import Guard, Watch
from macromicro.rig.limits import Limits
from macromicro.types import Command, Outputs, Sample

SILENCE = 1e-3 * SPEC["silence"]  # s
DECELERATE = 1e-3 * SPEC["decelerate"]  # s
LIMIT_SWITCH: int = SPEC["faults"]["limit_switch"]
BRIDGE: int = SPEC["faults"]["bridge"]
HOST_SILENT: int = SPEC["faults"]["host_silent"]


class Board(NamedTuple):
    """What the host writes into the board before it drives.

    Attributes
    ----------
    guard : Guard
        Limits, envelopes and the Hall sensor's table.
    macro : PdTuned
        Law of the macro-stage, in counts and V.
    micro : PiAntiWindup
        Law of the micro-stage, in m and V.
    width : float
        Dead zone that the macro-stage's effort is lifted over, V.
    """

    guard: Guard
    macro: PdTuned
    micro: PiAntiWindup
    width: float


class Order(NamedTuple):
    """What the host asked for last, and the lines.

    Attributes
    ----------
    holds : bool
        Whether the board closes the loop.
    command : Command
        Set points for that; `micro_position` is not used.
    motor, ctrl : float
        What to put out where it does not, V.
    quiet : float
        For how long the host has said nothing, s.
    low, high, fault : bool
        Limit switches and the bridge's fault, active.
    """

    holds: bool
    command: Command
    motor: float
    ctrl: float
    quiet: float
    low: bool
    high: bool
    fault: bool


class Held(NamedTuple):
    """What the board remembers.

    Attributes
    ----------
    watch : Watch
        Of the guard.
    error : float
        Last error of the macro-stage, counts.
    integral : float
        Integral effort of the micro-stage, V.
    motor : float
        Last effort of the motor, V.
    fault : int
        Of the board alone; 0 is none.
    """

    watch: Watch
    error: float
    integral: float
    motor: float
    fault: int


def fresh() -> Held:
    """The board as it begins to drive.

    Returns
    -------
    Held
        State.
    """
    return Held(guard.fresh(), 0.0, 0.0, 0.0, 0)


def prepare(limits: Limits, table: Calibration, macro: PdTuned, micro: PiAntiWindup,
            width: float) -> Board:  # fmt: skip
    """Parameters of the board, with a table of its length.

    Parameters
    ----------
    limits : Limits
        Of the guard.
    table : Calibration
        The Hall sensor's, of any length.
    macro : PdTuned
        Law of the macro-stage.
    micro : PiAntiWindup
        Law of the micro-stage.
    width : float
        Dead zone, V.

    Returns
    -------
    Board
        Parameters.
    """
    return Board(guard.prepare(limits, shortened(table)), macro, micro, width)


def shortened(table: Calibration) -> Calibration:
    """The table over the same voltages, with as many points as the board has room for.

    Parameters
    ----------
    table : Calibration
        Of any length.

    Returns
    -------
    Calibration
        Of `TABLE` points.
    """
    step = table.step * (len(table.position) - 1) / (TABLE - 1)
    volts = [table.low + k * step for k in range(TABLE)]
    return Calibration(table.low, step, np.array([calibration.position(table, v) for v in volts]))


@kernel
def step(p: Board, s: Held, sample: Sample, order: Order, dt: float) -> tuple[Held, float, float]:
    """One control period of the board.

    Parameters
    ----------
    p : Board
        Parameters.
    s : Held
        State.
    sample : Sample
        What the board measures.
    order : Order
        What the host asked for, and the lines.
    dt : float
        Control period, s.

    Returns
    -------
    state : Held
        New state; a fault in it latches.
    motor : float
        Effort of the motor from the next period on, V.
    ctrl : float
        CTRL from then on, V.
    """
    motor, ctrl = order.motor, order.ctrl
    error, integral = 0.0, 0.0
    asked = Command(0.0, 0.0, 0.0, 0.0, 0.0)
    if order.holds and order.quiet <= SILENCE:
        motor, ctrl = 0.0, 0.0
        asked = order.command
        if asked.macro_active > 0.5:
            error = asked.macro_reference - sample.encoder
            past = s.error if s.watch.macro.reference == asked.macro_reference else error
            effort = pd.effort(p.macro.now, p.macro.before, error, past)
            lifted = deadzone.inverse(p.width, effort)
            motor = min(max(lifted, -p.guard.limits.motor), p.guard.limits.motor)
        if asked.micro_active > 0.5:
            place = calibration.position(p.guard.calibration, sample.hall)
            integral, ctrl = pi.step(p.micro, s.integral, asked.micro_reference - place, dt)
    fault = s.fault
    if order.quiet > SILENCE:
        # The wire cools at once; the carriage is not stopped dead.
        ctrl = 0.0
        motor = s.motor
        left = SILENCE + DECELERATE - order.quiet
        motor = motor * max(1.0 - dt / left, 0.0) if left > dt else 0.0
        if fault == OK and left <= dt:
            fault = HOST_SILENT
    if fault == OK and order.fault:
        fault = BRIDGE
    if fault == OK and ((order.low and motor < 0.0) or (order.high and motor > 0.0)):
        fault = LIMIT_SWITCH
    if fault != OK:
        motor, ctrl = 0.0, 0.0
    watch, out = guard.step(p.guard, s.watch, sample, asked, Outputs(motor, ctrl, 0.0, 0.0), dt)
    return Held(watch, error, integral, out.motor, fault), out.motor, out.ctrl
