"""One control period of the board, from which the firmware's C is exported."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from macromicro.columns import Meaning
from macromicro.control import calibration, deadzone, pd, pi
from macromicro.control.calibration import Calibration
from macromicro.control.pd import PdTuned
from macromicro.control.pi import PiAntiWindup
from macromicro.control.settings import Control
from macromicro.kernel import kernel
from macromicro.rig import guard
from macromicro.rig.board import framing
from macromicro.rig.board.protocol import BOARD, FORMATS, HOST, SPEC, TABLE
from macromicro.rig.codes import ILLEGAL, OK
from macromicro.rig.guard import Guard
from macromicro.rig.limits import NEVER, Limits

SILENCE = 1e-3 * SPEC["silence"]  # s
DECELERATE = 1e-3 * SPEC["decelerate"]  # s
LIMIT_SWITCH: int = SPEC["faults"]["limit_switch"]
BRIDGE: int = SPEC["faults"]["bridge"]
HOST_SILENT: int = SPEC["faults"]["host_silent"]


class Board(NamedTuple):
    """Parameters that the host writes before the board drives."""

    guard: Annotated[Guard, Meaning("limits, envelopes and the Hall sensor's table")]
    macro: Annotated[PdTuned, Meaning("law of the macro-stage, in counts and V")]
    micro: Annotated[PiAntiWindup, Meaning("law of the micro-stage, in m and V")]
    width: Annotated[float, Meaning("dead zone that the macro-stage's effort is lifted over", "V")]


class Order(NamedTuple):
    """The host's last command, and the lines."""

    holds: Annotated[bool, Meaning("whether the board closes the loop")]
    macro_reference: Annotated[float, Meaning("set point for that", "count")]
    micro_reference: Annotated[float, Meaning("", "m")]
    macro_active: Annotated[bool, Meaning("which stage is under control")]
    micro_active: Annotated[bool, Meaning("which stage is under control")]
    motor: Annotated[float, Meaning("what to put out where it does not", "V")]
    ctrl: Annotated[float, Meaning("what to put out where it does not", "V")]
    quiet: Annotated[float, Meaning("for how long the host has said nothing", "s")]
    low: Annotated[bool, Meaning("limit switches and the bridge's fault, active")]
    high: Annotated[bool, Meaning("limit switches and the bridge's fault, active")]
    fault: Annotated[bool, Meaning("limit switches and the bridge's fault, active")]


class Effort(NamedTuple):
    """Memories of the laws, and a latched fault."""

    reference: Annotated[
        float, Meaning("set point of the macro-stage in the last period; NaN: none", "count")
    ]
    error: Annotated[float, Meaning("its last error", "count")]
    integral: Annotated[float, Meaning("integral effort of the micro-stage", "V")]
    motor: Annotated[float, Meaning("last effort of the motor", "V")]
    fault: Annotated[int, Meaning("ILLEGAL, or one of the board alone; 0 is none")]


REST = Effort(math.nan, 0.0, 0.0, 0.0, OK)


def prepare(limits: Limits, table: Calibration, macro: PdTuned, micro: PiAntiWindup,
            width: float) -> Board:  # fmt: skip
    return Board(guard.prepare(limits, shorten(table)), macro, micro, width)


def of(limits: Limits, table: Calibration | None, gains: Control | None = None) -> Board:
    """Parameters for a machine with this Hall sensor or without one."""
    gains = gains or Control()
    if table is None:
        table = Calibration(0.0, 1.0, np.zeros(2))
        limits = limits._replace(frozen=NEVER, rail_time=NEVER, noise=NEVER, silent=NEVER)
    return prepare(limits, table, gains.pd_tuned, gains.pi_antiwindup, gains.dead_zone)


def shorten(table: Calibration) -> Calibration:
    """The table with as many points as the board has room for."""
    step = table.step * (len(table.position) - 1) / (TABLE - 1)
    volts = [table.low + k * step for k in range(TABLE)]
    return Calibration(table.low, step, np.array([calibration.position(table, v) for v in volts]))


@kernel
def drive(
    p: Board,
    s: Effort,
    encoder: Annotated[float, Meaning("count", "count")],
    hall: Annotated[float, Meaning("NaN: no value", "V")],
    order: Order,
    dt: float,
) -> tuple[
    Annotated[Effort, Meaning(name="state")],
    Annotated[float, Meaning("effort of the motor from the next period on", "V", name="motor")],
    Annotated[float, Meaning("CTRL from then on", "V", name="ctrl")],
]:
    """One control period of the laws (`encoder` in counts); `guard.step` watches beside it."""
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


def flat(params: Any, path: str = "") -> dict[str, float]:
    """Every number of the parameters, by its path; tables last."""
    found: dict[str, float] = {}
    tables: dict[str, float] = {}
    for name, value in zip(params._fields, params, strict=True):
        place = f"{path}.{name}" if path else name
        if isinstance(value, tuple):
            found |= {k: v for k, v in flat(value, place).items() if "[" not in k}
            tables |= {k: v for k, v in flat(value, place).items() if "[" in k}
        elif isinstance(value, np.ndarray):
            tables |= {f"{place}[{k}]": float(each) for k, each in enumerate(value)}
        else:
            found[place] = float(value)
    return found | tables


def words(params: Board) -> bytes:
    """The parameters as 32-bit words."""
    return np.array(list(flat(params).values()), "<f4").tobytes()


def layout(params: Board) -> int:
    """A checksum of the protocol's frames and the parameters' names."""
    known = [f"{m.id} {m.name} {m.fields}" for m in (*HOST.values(), *BOARD.values())]
    text = "\n".join([*known, *FORMATS, *flat(params)])
    return framing.crc16(text.encode())


def single(value: float) -> float:
    """A number rounded to 32 bits."""
    return float(np.float32(value))
