"""The macro-stage as the thesis models it: (4.2)-(4.5), dead zones, saturation.

Three models of one structure: `LINEAR` knows no friction and no limit, `INITIAL` has the
dead zone of Figure 4.9 and the saturation, `TUNED` the dead zone with a jump of Figure 4.14
in its place. Volts at the D/A board, positions in counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control import macro as control
from macromicro.control.macro import MacroLaw
from macromicro.control.stage_law import Sample, Target
from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel
from macromicro.nominal import FULL_SCALE, PERIOD

LINEAR, INITIAL, TUNED = 0, 1, 2


class Motor(NamedTuple):
    """Parameters of (4.1).

    Attributes
    ----------
    ka : float
        Gain of the amplifier.
    r : float
        Resistance, ohm.
    kb : float
        Back-EMF constant, V s/rad.
    kt : float
        Torque constant, N m/A.
    b : float
        Damping, N m s/rad.
    j : float
        Inertia, kg m2.
    klin : float
        Counts per angle, counts/rad.
    """

    ka: float
    r: float
    kb: float
    kt: float
    b: float
    j: float
    klin: float


class Linear(NamedTuple):
    """(4.3), speed over volts: b / (z + a). Default: as identified.

    Attributes
    ----------
    a : float
        Dimensionless.
    b : float
        counts/s/V.
    dt : float
        Sample time, s.
    """

    a: float = -0.95833
    b: float = 165.72
    dt: float = PERIOD


class MacroModel(NamedTuple):
    """Linear dynamics behind a saturation and a dead zone. Default: as printed.

    Attributes
    ----------
    linear : Linear
        (4.3).
    kind : int
        LINEAR, INITIAL or TUNED.
    width : float
        Dead zone, V.
    a0 : float
        a0 of (4.5), V.
    delta : float
        Delta of (4.5), dimensionless.
    limit : float
        Saturation, V.
    """

    linear: Linear = Linear()
    kind: int = TUNED
    width: float = 3.0
    a0: float = 0.364
    delta: float = 0.636
    limit: float = FULL_SCALE


class MacroModelState(NamedTuple):
    """Position x [counts] and speed v [counts/s].

    Attributes
    ----------
    x : float
        Position, counts.
    v : float
        Speed, counts/s.
    """

    x: float
    v: float


def transfer(p: Motor) -> tuple[float, float]:
    """(4.2): speed over volts, gain / (s + pole), from (4.1).

    Parameters
    ----------
    p : Motor
        Parameters of the motor.

    Returns
    -------
    gain : float
        counts/s2/V.
    pole : float
        rad/s.

    Raises
    ------
    InputError
        r or j is not above 0.
    """
    if not all(math.isfinite(v) and v > 0.0 for v in (p.r, p.j)):
        raise InputError("motor, r and j", (p.r, p.j), "above 0")
    return p.ka * p.klin * p.kt / (p.j * p.r), (p.b * p.r + p.kt * p.kb) / (p.j * p.r)


def discretised(gain: float, pole: float, dt: float) -> Linear:
    """(4.3) from (4.2), its input held. The printed a lacks a minus sign.

    Parameters
    ----------
    gain : float
        Gain, counts/s2/V.
    pole : float
        Pole, rad/s.
    dt : float
        Sample time, s.

    Returns
    -------
    Linear
        b / (z + a).

    Raises
    ------
    InputError
        `pole` or `dt` is not above 0.
    """
    if not (pole > 0.0 and dt > 0.0):
        raise InputError("discretised: pole, dt", (pole, dt), "both above 0")
    return Linear(-math.exp(-pole * dt), -gain / pole * math.expm1(-pole * dt), dt)


def position_transfer(p: Linear) -> tuple[Array, Array]:
    """(4.4): (4.3) times dt/(z - 1).

    Parameters
    ----------
    p : Linear
        (4.3).

    Returns
    -------
    num : ndarray, shape (1,)
        Coefficients in z, highest power first.
    den : ndarray, shape (3,)
        Likewise.
    """
    return np.array([p.b * p.dt]), np.array([1.0, p.a - 1.0, -p.a])


@kernel
def saturated(limit: float, volts: float) -> float:
    """A voltage within limits (Section 4.2.1).

    Parameters
    ----------
    limit : float
        Limit, V.
    volts : float
        Voltage, V.

    Returns
    -------
    float
        V.
    """
    return min(max(volts, -limit), limit)


@kernel
def dead_zone(width: float, volts: float) -> float:
    """What is left of a voltage beyond a dead zone (Figure 4.9).

    Parameters
    ----------
    width : float
        To either side, V.
    volts : float
        Voltage, V.

    Returns
    -------
    float
        V.
    """
    if volts > width:
        return volts - width
    if volts < -width:
        return volts + width
    return 0.0


@kernel
def jump_zone(width: float, a0: float, delta: float, volts: float) -> float:
    """Dead zone with a jump (Figure 4.14): none up to `width`, (4.5) of the rest beyond.

    Parameters
    ----------
    width : float
        To either side, V.
    a0 : float
        a0 of (4.5), V.
    delta : float
        Delta of (4.5).
    volts : float
        Voltage, V.

    Returns
    -------
    float
        V.
    """
    # `jump` of `dead_zone` in one expression, which a batch computes in vector registers.
    rest = abs(volts) - width
    return math.copysign(a0 + delta * rest, volts) if rest > 0.0 else 0.0


@kernel
def jump(a0: float, delta: float, volts: float) -> float:
    """(4.5), read (a0 + delta |V|) sgn V.

    Parameters
    ----------
    a0 : float
        a0 of (4.5), V.
    delta : float
        Dimensionless.
    volts : float
        Voltage, V.

    Returns
    -------
    float
        V; 0 at 0.
    """
    if volts == 0.0:
        return 0.0
    return math.copysign(a0 + delta * abs(volts), volts)


@kernel
def net_volts(p: MacroModel, motor: float) -> float:
    """Volts that reach the linear dynamics.

    Parameters
    ----------
    p : MacroModel
        The model.
    motor : float
        Volts at the D/A board, V.

    Returns
    -------
    float
        V.
    """
    if p.kind == LINEAR:
        # The inverse is taken to cancel the friction wholly (Figure 4.19).
        return dead_zone(p.width, motor)
    limited = saturated(p.limit, motor)
    if p.kind == INITIAL:
        return dead_zone(p.width, limited)
    return jump_zone(p.width, p.a0, p.delta, limited)


@kernel
def step(p: MacroModel, s: MacroModelState, motor: float) -> MacroModelState:
    """The model one period later: (4.3), then the integrator of (4.4).

    Parameters
    ----------
    p : MacroModel
        The model.
    s : MacroModelState
        State of the model.
    motor : float
        Volts at the D/A board, held, V.

    Returns
    -------
    MacroModelState
        New state.
    """
    v = p.linear.b * net_volts(p, motor) - p.linear.a * s.v
    return MacroModelState(s.x + p.linear.dt * s.v, v)


@kernel
def _open(p: MacroModel, s: MacroModelState, motor: Array, out: Array) -> None:
    for k in range(len(motor)):
        out[k] = s.x
        s = step(p, s, motor[k])


@kernel
def whole(x: float) -> float:
    """The greatest whole number not above another, as floats.

    Not `math.floor`, which compiled code reaches only over integers.

    Parameters
    ----------
    x : float
        A number, |x| < 2^51.

    Returns
    -------
    float
        Whole.
    """
    nearest = (x + 6755399441055744.0) - 6755399441055744.0  # 1.5 * 2^52: no place for halves
    return nearest - 1.0 if nearest > x else nearest


@kernel
def rollout(
    p: MacroModel, law: MacroLaw, s: MacroModelState, reference: Array, counted: bool, out: Array
) -> MacroModelState:
    """The loop of `closed_loop` from a state on, as a kernel.

    Parameters
    ----------
    p : MacroModel
        The model.
    law : MacroLaw
        The controller.
    s : MacroModelState
        State at the start.
    reference : ndarray, shape (n,)
        Reference, counts.
    counted : bool
        Whether the law sees whole counts.
    out : ndarray, shape (2, n)
        Positions (counts) and D/A volts (V) are written here.

    Returns
    -------
    MacroModelState
        The state at the end.
    """
    memory, dt = control.begun(law), p.linear.dt
    seen = math.nan
    for k in range(len(reference)):
        if not counted:
            seen = s.x
        elif not seen <= s.x < seen + 1.0:
            # Only a new count: the next effort need not wait for the position's arithmetic.
            seen = whole(s.x)
        memory, motor = control.step(
            law, memory, Target(reference[k], 0.0, 0.0, math.inf), Sample(k * dt, seen), dt
        )
        out[0, k], out[1, k] = seen, motor
        s = step(p, s, motor)
    return s


def simulate(p: MacroModel, motor: npt.ArrayLike, start: float = 0.0) -> Array:
    """Position for a course of D/A volts, from rest (Figures 4.12, 4.16).

    Parameters
    ----------
    p : MacroModel
        The model.
    motor : array_like, shape (n,)
        D/A volts, V, a sample each ``p.linear.dt``.
    start : float, optional
        Position at the start, counts.

    Returns
    -------
    ndarray, shape (n,)
        Before volts k act, counts.
    """
    sent = np.ascontiguousarray(motor, dtype=np.float64)
    out = np.empty_like(sent)
    compiled(_open)(p, MacroModelState(float(start), 0.0), sent, out)
    return out


def closed_loop(
    p: MacroModel,
    law: MacroLaw,
    reference: npt.ArrayLike,
    start: float = 0.0,
    counted: bool = False,
) -> tuple[Array, Array]:
    """Position and D/A volts under a control law (Figures 4.19, 4.21).

    The law's own limit saturates the volts, which act without the bench's delay.

    Parameters
    ----------
    p : MacroModel
        The model.
    law : MacroLaw
        The controller.
    reference : array_like, shape (n,)
        counts, a sample each ``p.linear.dt``.
    start : float, optional
        Position at the start, counts.
    counted : bool, optional
        Whether the law sees, and the result holds, the whole counts that an encoder shows (rounded
        down), or the position itself.

    Returns
    -------
    x : ndarray, shape (n,)
        Position, counts.
    motor : ndarray, shape (n,)
        D/A volts, V.
    """
    target = np.ascontiguousarray(reference, dtype=np.float64)
    out = np.empty((2, len(target)))
    law.machine(rollout)(p, law, MacroModelState(float(start), 0.0), target, counted, out)
    return out[0], out[1]
