"""One control period of the board: its laws, and what limit switches and silence of the host do.

The firmware runs the C that is exported from it (`macromicro export c two_stage.board --float`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.control import calibration, deadzone, pd, pi
from macromicro.control.calibration import Calibration
from macromicro.control.pd import PdTuned
from macromicro.control.pi import PiAntiWindup
from macromicro.control.settings import Control
from macromicro.kernel import kernel
from macromicro.rig import guard
from macromicro.rig.board.protocol import SPEC, TABLE
from macromicro.rig.codes import ILLEGAL, OK
from macromicro.rig.guard import Guard
from macromicro.rig.limits import Limits

SILENCE = 1e-3 * SPEC["silence"]  # s
DECELERATE = 1e-3 * SPEC["decelerate"]  # s
LIMIT_SWITCH: int = SPEC["faults"]["limit_switch"]
BRIDGE: int = SPEC["faults"]["bridge"]
_NEVER = 1e9  # s, V; beyond anything measured
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
    macro_reference : float
        Set point for that, counts.
    micro_reference : float
        m.
    macro_active, micro_active : bool
        Which stage is under control.
    motor, ctrl : float
        What to put out where it does not, V.
    quiet : float
        For how long the host has said nothing, s.
    low, high, fault : bool
        Limit switches and the bridge's fault, active.
    """

    holds: bool
    macro_reference: float
    micro_reference: float
    macro_active: bool
    micro_active: bool
    motor: float
    ctrl: float
    quiet: float
    low: bool
    high: bool
    fault: bool


class Effort(NamedTuple):
    """What the laws remember, and a fault that latches.

    Attributes
    ----------
    reference : float
        Set point of the macro-stage in the last period, counts; NaN: none.
    error : float
        Its last error, counts.
    integral : float
        Integral effort of the micro-stage, V.
    motor : float
        Last effort of the motor, V.
    fault : int
        `ILLEGAL`, or one of the board alone; 0 is none.
    """

    reference: float
    error: float
    integral: float
    motor: float
    fault: int


REST = Effort(math.nan, 0.0, 0.0, 0.0, OK)


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


def thesis(limits: Limits, table: Calibration | None) -> Board:
    """Parameters with the thesis' laws, for a machine with this Hall sensor or without one.

    Parameters
    ----------
    limits : Limits
        Of the guard.
    table : Calibration | None
        The Hall sensor's; None: there is none, and nothing is expected of it.

    Returns
    -------
    Board
        Parameters.
    """
    gains = Control()
    if table is None:
        table = Calibration(0.0, 1.0, np.zeros(2))
        limits = limits._replace(frozen=_NEVER, rail_time=_NEVER, noise=_NEVER, silent=_NEVER)
    return prepare(limits, table, gains.pd_tuned, gains.pi_antiwindup, gains.dead_zone)


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
def drive(
    p: Board, s: Effort, encoder: float, hall: float, order: Order, dt: float
) -> tuple[Effort, float, float]:
    """One control period of the laws; `guard.step` watches beside it.

    Parameters
    ----------
    p : Board
        Parameters.
    s : Effort
        State.
    encoder : float
        counts.
    hall : float
        V; NaN: no value.
    order : Order
        What the host asked for, and the lines.
    dt : float
        Control period, s.

    Returns
    -------
    state : Effort
        New state; a fault in it latches.
    motor : float
        Effort of the motor from the next period on, V.
    ctrl : float
        CTRL from then on, V.
    """
    motor, ctrl = order.motor, order.ctrl
    reference, error, integral = math.nan, 0.0, 0.0
    limits = p.guard.limits
    if order.quiet > SILENCE:
        # The wire cools at once; the carriage is not stopped dead.
        left = SILENCE + DECELERATE - order.quiet
        motor = s.motor * (1.0 - dt / left) if left > dt else 0.0
        ctrl = 0.0
    elif order.holds:
        motor, ctrl = 0.0, 0.0
        if order.macro_active:
            reference = order.macro_reference
            error = reference - encoder
            past = s.error if reference == s.reference else error
            effort = pd.effort(p.macro.now, p.macro.before, error, past)
            motor = deadzone.inverse(p.width, effort)
            motor = min(max(motor, -limits.motor), limits.motor)
        if order.micro_active:
            integral = s.integral
            if not math.isnan(hall):
                away = order.micro_reference - calibration.position(p.guard.calibration, hall)
                integral, ctrl = pi.step(p.micro, integral, away, dt)
    fault = s.fault
    if fault == OK:
        if not (abs(motor) <= limits.motor and 0.0 <= ctrl <= limits.ctrl):  # NaN, too
            fault = ILLEGAL
        elif order.fault:
            fault = BRIDGE
        elif (order.low and motor < 0.0) or (order.high and motor > 0.0):
            fault = LIMIT_SWITCH
        elif order.quiet >= SILENCE + DECELERATE:
            fault = HOST_SILENT
    if fault != OK:
        motor, ctrl = 0.0, 0.0
    return Effort(reference, error, integral, motor, fault), motor, ctrl
