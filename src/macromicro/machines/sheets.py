"""What an axis' data sheets say together: masses, forces, delays, and the linear plant."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.machines.loops import Complex, stepped
from macromicro.machines.parts import MOTOR
from macromicro.plant import transmission
from macromicro.plant.power import CURRENT
from macromicro.plant.transmission import LINEAR

GRAVITY = 9.80665
SPARE = 0.7  # share of supply and current that moves may use


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


def turn(tree: Any) -> float:
    """Way of the load per turn of the motor.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        m; infinity for a linear motor.
    """
    if tree.drive.kind == LINEAR:
        return math.inf
    return 2.0 * math.pi / transmission.ratio(tree.drive)


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


def unbalanced(tree: Any) -> tuple[float, float]:
    """Gravity on an eccentric load.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    unbalance : float
        Greatest torque, N m; 0 of a slide.
    hangs : float
        Angle at which the load hangs, rad.
    """
    load = tree.load
    return float(getattr(load, "unbalance", 0.0)), float(getattr(load, "hangs", 0.0))


def endless(tree: Any) -> bool:
    """Whether nothing ends the way of an axis: it turns on.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    bool
        False for a slide.
    """
    return bool(getattr(tree.load, "endless", False))


def pulled(tree: Any, place: float) -> float:
    """Pull of gravity at a place, towards lower positions.

    Parameters
    ----------
    tree : Any
        Settings of an axis.
    place : float
        m, or rad.

    Returns
    -------
    float
        N, or N m.
    """
    most, hangs = unbalanced(tree)
    return weight(tree) + most * math.sin(place - hangs)


def heaviest(tree: Any) -> float:
    """Greatest pull of gravity anywhere, of either sign.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    float
        N, or N m.
    """
    return abs(weight(tree)) + unbalanced(tree)[0]


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
    return float(rubbing.coulomb + rubbing.stribeck + rubbing.ripple + heaviest(tree))


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
    return float(tree.friction.coulomb + tree.friction.ripple + heaviest(tree))


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


def impedance(
    s: Complex,
    *,
    rotor: float,
    moved: float,
    viscous: float,
    frequency: float,
    damping: float,
) -> tuple[Complex, Complex]:
    """Force per speed of the motor, and the load's part of that speed, with a drive between them.

    Parameters
    ----------
    s : ndarray of complex, shape (n,)
        Laplace's variable, rad/s.
    rotor, moved : float
        Masses of the motor's side and of the load, kg.
    viscous : float
        Friction of the load, N s/m.
    frequency : float
        Mode of the load on the drive, motor held, Hz; 0: stiff.
    damping : float
        Damping ratio of that mode.

    Returns
    -------
    drag : ndarray of complex, shape (n,)
        N s/m.
    seen : ndarray of complex, shape (n,)
        1 where stiff.
    """
    load = moved * s + viscous
    if frequency <= 0.0:
        return rotor * s + load, np.ones_like(s)
    stiffness = moved * (2.0 * math.pi * frequency) ** 2
    spring = stiffness / s + 2.0 * damping * math.sqrt(stiffness * moved)
    seen = spring / (spring + load)
    return rotor * s + load * seen, seen


def plant(tree: Any, frequency: Array) -> Complex:
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
    amp, motor = tree.amplifier, tree.motor
    s = np.asarray(2j * math.pi * np.asarray(frequency), np.complex128)
    moved = float(tree.load.mass + tree.load.payload)
    drag, seen = impedance(
        s,
        rotor=turning(tree),
        moved=moved,
        viscous=tree.friction.viscous,
        frequency=tree.drive.frequency,
        damping=tree.drive.damping,
    )
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
    found: Complex = speed / s * stepped(s, tree.timing)
    return found
