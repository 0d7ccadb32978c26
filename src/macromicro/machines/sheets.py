"""What follows from an axis' data sheets: masses, forces, and settings that nobody has set.

Each derived setting is a rule from the tree to its value; `RULES` lists them so that none depends
on a later one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.machines.parts import MOTOR
from macromicro.plant import transmission
from macromicro.plant.power import CURRENT
from macromicro.plant.transmission import LINEAR

Rule = tuple[str, Callable[[Any], float]]

GRAVITY = 9.80665
SPARE = 0.7  # share of supply and current that moves may use
MARGIN = 0.02  # of the way between the stops that stays free at either end
FINEST = 50e-6  # s; longest step of the physics
COUNTED = 0.15  # share of the effort that one count's step may take
OUTER, OBSERVER = 0.25, 7.0  # position loop and observer, to the velocity loop's bandwidth
ROOM = 0.33  # rad; phase that all delays may take at the velocity loop's bandwidth


def rounded(value: float, digits: int = 4) -> float:
    """To some significant digits: a derived setting claims no more.

    Parameters
    ----------
    value : float
        Any number.
    digits : int, optional
        How many.

    Returns
    -------
    float
        The nearest of these.
    """
    return float(f"{value:.{digits}g}")


def constant(tree: Any) -> float:
    """Force constant at the load, also that of the back-EMF.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        N/A, or V s/m.
    """
    if tree.drive.kind == LINEAR:
        return float(tree.motor.force)
    return float(tree.motor.constant * transmission.ratio(tree.drive))


def turning(tree: Any) -> float:
    """What turns with the motor, as a mass at the load.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        kg; 0 for a linear motor, whose forcer belongs to the moving mass.
    """
    if tree.drive.kind == LINEAR:
        return 0.0
    ratio = transmission.ratio(tree.drive)
    return float((tree.motor.inertia + tree.drive.inertia) * ratio * ratio)


def mass(tree: Any) -> float:
    """All that moves, at the load.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        kg.
    """
    return float(turning(tree) + tree.load.mass + tree.load.payload)


def weight(tree: Any) -> float:
    """Pull of gravity along the way, towards lower positions.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        N.
    """
    moved = tree.load.mass + tree.load.payload
    return float(moved * GRAVITY * math.sin(tree.load.incline))


def current(tree: Any) -> float:
    """Greatest current that amplifier, supply and D/A give at rest.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        A.
    """
    amp = tree.amplifier
    most = min(amp.current, amp.supply / tree.motor.resistance)
    if amp.mode == CURRENT:
        return float(min(most, amp.transconductance * amp.full_scale))
    return float(min(most, amp.gain * amp.full_scale / tree.motor.resistance))


def force(tree: Any) -> float:
    """Greatest force at the load, at rest.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        N.
    """
    return current(tree) * constant(tree) * float(tree.drive.efficiency)


def per_newton(tree: Any) -> float:
    """Effort at rest per force at the load.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        V/N.
    """
    push = constant(tree) * tree.drive.efficiency
    if tree.amplifier.mode == CURRENT:
        return float(1.0 / (push * tree.amplifier.transconductance))
    return float(tree.motor.resistance / (push * tree.amplifier.gain))


def held(tree: Any) -> float:
    """Force that friction and weight take together to start upwards.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        N.
    """
    rubbing = tree.friction
    return float(rubbing.coulomb + rubbing.stribeck + rubbing.ripple + abs(weight(tree)))


def rubbed(tree: Any) -> float:
    """Force that friction and weight take together while it moves upwards, viscous part aside.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        N.
    """
    return float(tree.friction.coulomb + tree.friction.ripple + abs(weight(tree)))


def left(tree: Any) -> float:
    """Force that is left for acceleration, of the share that moves may use.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        N; at least a hundredth of the motor's, so that what follows stays finite where
        `feasible` refuses.
    """
    return max(SPARE * force(tree) - rubbed(tree), 0.01 * force(tree))


def fastest(tree: Any) -> float:
    """Speed at which the share of the supply that moves may use is taken up by the back-EMF and
    by what friction needs.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        m/s.
    """
    amp = tree.amplifier
    volts = amp.supply
    if amp.mode != CURRENT:
        volts = min(volts, amp.gain * amp.full_scale)
    k = constant(tree)
    push = k * tree.drive.efficiency
    ohmic = tree.motor.resistance / push
    # SPARE V = R/K (coulomb + weight + viscous v) + K v
    v = (SPARE * volts - ohmic * rubbed(tree)) / (k + ohmic * tree.friction.viscous)
    return float(max(v, 0.01 * SPARE * volts / k))


def _velocity(tree: Any) -> float:
    """What the motor can at 0.7 of its supply, what the encoder can count, what the way allows."""
    way = tree.travel.high - tree.travel.low
    by_way = math.sqrt(max(way, 1e-9) * left(tree) / mass(tree))
    by_counter = 0.8 * tree.encoder.rate * tree.encoder.pitch
    return rounded(min(0.9 * fastest(tree), by_counter, by_way))


def _acceleration(tree: Any) -> float:
    # At the greatest speed the back-EMF leaves less of the supply: half is for that.
    return rounded(0.6 * left(tree) / mass(tree))


def lag(tree: Any) -> float:
    """All delays of the velocity loop: hold, computing, and amplifier or winding.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        s.
    """
    electrical = 1.0 / (2.0 * math.pi * tree.amplifier.bandwidth)
    if tree.amplifier.mode != CURRENT:
        electrical = tree.motor.inductance / tree.motor.resistance
    return float(tree.timing.period + tree.timing.delay + electrical)


def bandwidth(tree: Any) -> float:
    """Bandwidth of the velocity loop: what delays, flexibility and the encoder allow.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        rad/s.
    """
    by_lag = ROOM / lag(tree)
    found = by_lag
    if tree.drive.frequency > 0.0:
        found = min(found, 0.3 * 2.0 * math.pi * tree.drive.frequency)
    # A count's step through observer and velocity gain stays below COUNTED of the effort:
    # per_newton mass w (observer pitch) with the observer at OBSERVER w.
    step = OBSERVER * per_newton(tree) * mass(tree) * tree.encoder.pitch
    by_count = math.sqrt(COUNTED * tree.controller.limit / step)
    return min(found, by_count)


def _pitch(tree: Any) -> float:
    if tree.encoder.at != MOTOR or tree.drive.kind == LINEAR:
        return 1.0e-6
    per_turn = 2.0 * math.pi / transmission.ratio(tree.drive)
    return float(round(per_turn / (4.0 * tree.encoder.lines), 15))


def _steps(tree: Any) -> float:
    finest = FINEST
    if tree.drive.frequency > 0.0:
        stiff = (2.0 * math.pi * tree.drive.frequency) ** 2
        moved = tree.load.mass + tree.load.payload
        both = stiff * (1.0 + moved / max(turning(tree), 0.01 * moved))
        finest = min(finest, 0.2 / math.sqrt(both))
    return float(min(max(math.ceil(tree.timing.period / finest), 1), 20000))


def _low(tree: Any) -> float:
    way = tree.load.stop_high - tree.load.stop_low
    return min(rounded(tree.load.stop_low + MARGIN * way), 0.0)


def _friction_volts(tree: Any) -> float:
    return rounded(per_newton(tree) * tree.friction.coulomb)


def _ahead_velocity(tree: Any) -> float:
    emf = 0.0 if tree.amplifier.mode == CURRENT else constant(tree) / tree.amplifier.gain
    return rounded(emf + per_newton(tree) * tree.friction.viscous)


def _soft(tree: Any, way: float) -> float:
    """Half way from the travel's end to the stop."""
    if way < 0.0:
        return rounded(0.5 * (tree.travel.low + tree.load.stop_low))
    return rounded(0.5 * (tree.travel.high + tree.load.stop_high))


def _following(tree: Any) -> float:
    """What the position loop lags by at the greatest speed, were nothing fed forward; or 20
    tolerances."""
    slow = tree.motion.velocity / max(tree.controller.position, 1e-9)
    return rounded(max(slow, 20.0 * tree.arrival.tolerance))


def _tolerance(tree: Any) -> float:
    return rounded(max(4.0 * tree.encoder.pitch, 4.0 * tree.encoder.noise, 1.0e-7))


RULES: tuple[Rule, ...] = (
    ("amplifier.gain", lambda t: rounded(t.amplifier.supply / t.amplifier.full_scale, 12)),
    (
        "amplifier.transconductance",
        lambda t: rounded(t.amplifier.current / t.amplifier.full_scale, 12),
    ),
    ("encoder.pitch", _pitch),
    ("timing.steps", _steps),
    ("travel.low", _low),
    (
        "travel.high",
        lambda t: rounded(t.load.stop_high - MARGIN * (t.load.stop_high - t.load.stop_low)),
    ),
    ("arrival.tolerance", _tolerance),
    ("motion.velocity", _velocity),
    ("motion.acceleration", _acceleration),
    ("guard.effort", lambda t: t.amplifier.full_scale),
    ("controller.limit", lambda t: t.guard.effort),
    ("controller.velocity", lambda t: rounded(per_newton(t) * mass(t) * bandwidth(t))),
    ("controller.integral", lambda t: rounded(OUTER * bandwidth(t))),
    ("controller.position", lambda t: rounded(OUTER * bandwidth(t))),
    ("controller.observer", lambda t: rounded(OBSERVER * bandwidth(t))),
    ("controller.ahead_velocity", _ahead_velocity),
    ("controller.ahead_acceleration", lambda t: rounded(per_newton(t) * mass(t))),
    ("controller.ahead_friction", _friction_volts),
    ("controller.ahead_gravity", lambda t: rounded(per_newton(t) * weight(t))),
    ("controller.rest", lambda t: rounded(0.5 * t.arrival.tolerance)),
    # Within the time in which the velocity loop follows.
    ("motion.jerk", lambda t: rounded(0.25 * t.motion.acceleration * bandwidth(t))),
    ("guard.low", lambda t: _soft(t, -1.0)),
    ("guard.high", lambda t: _soft(t, 1.0)),
    ("guard.speed", lambda t: rounded(1.5 * t.motion.velocity)),
    ("guard.error", _following),
    ("guard.push", lambda t: rounded(min(2.0 * per_newton(t) * held(t), 0.95 * t.guard.effort))),
)


def plant(tree: Any, frequency: Array) -> npt.NDArray[np.complex128]:
    """Position at the encoder per effort, as the sheets say: linear, sliding, without slack.

    With the hold over a period and the delay of the output.

    Parameters
    ----------
    tree : Any
        Settings of an axis.
    frequency : ndarray, shape (n,)
        Hz.

    Returns
    -------
    ndarray of complex, shape (n,)
        m/V.
    """
    amp, motor, dt = tree.amplifier, tree.motor, tree.timing.period
    s = 2j * math.pi * np.asarray(frequency, dtype=np.float64)
    rotor, moved = turning(tree), float(tree.load.mass + tree.load.payload)
    load = moved * s + tree.friction.viscous
    drag, seen = rotor * s + load, np.ones_like(s)
    if tree.drive.frequency > 0.0:
        stiffness = moved * (2.0 * math.pi * tree.drive.frequency) ** 2
        spring = stiffness / s + 2.0 * tree.drive.damping * math.sqrt(stiffness * moved)
        seen = spring / (spring + load)
        drag = rotor * s + load * seen
    k = constant(tree)
    push = k * tree.drive.efficiency
    if amp.mode == CURRENT:
        pole = 2.0 * math.pi * amp.bandwidth
        speed = amp.transconductance * push / ((1.0 + s / pole) * drag)
    else:
        winding = motor.resistance + motor.inductance * s
        speed = amp.gain * push / (winding * drag + push * k)
    if tree.encoder.at != MOTOR:
        speed = speed * seen
    hold = (1.0 - np.exp(-s * dt)) / (s * dt)
    found: npt.NDArray[np.complex128] = speed / s * hold * np.exp(-s * tree.timing.delay)
    return found
