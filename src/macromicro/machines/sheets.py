"""Masses, forces, delays and linear plant from an axis' data sheets."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.machines.loops import Complex, hold_and_delay
from macromicro.machines.parts import MOTOR
from macromicro.plant.power import CURRENT
from macromicro.plant.transmission import LINEAR

GRAVITY = 9.80665
TURN = 2.0 * math.pi  # rad
SPARE = 0.7  # share of supply and current that moves may use


def constant(tree: Any) -> float:
    """Force constant at the load, also that of the back-EMF."""
    if tree.drive.kind == LINEAR:
        return float(tree.motor.force)
    return float(tree.motor.constant * tree.drive.ratio)


def turning(tree: Any) -> float:
    """Rotating inertia of the motor as a mass at the load."""
    if tree.drive.kind == LINEAR:
        return 0.0
    ratio = tree.drive.ratio
    return float((tree.motor.inertia + tree.drive.inertia) * ratio * ratio)


def turn(tree: Any) -> float:
    """Travel of the load per turn of the motor."""
    if tree.drive.kind == LINEAR:
        return math.inf
    return float(2.0 * math.pi / tree.drive.ratio)


def mass(tree: Any) -> float:
    """Total moving mass at the load."""
    return float(turning(tree) + tree.load.mass + tree.load.payload)


def weight(tree: Any) -> float:
    """Gravity along the axis, towards lower positions."""
    moved = tree.load.mass + tree.load.payload
    return float(moved * GRAVITY * math.sin(tree.load.incline))


def eccentric_load(tree: Any) -> tuple[float, float]:
    """Gravity on an eccentric load."""
    load = tree.load
    return float(getattr(load, "unbalance", 0.0)), float(getattr(load, "hangs", 0.0))


def endless(tree: Any) -> bool:
    """Whether the axis has continuous rotation."""
    return bool(getattr(tree.load, "endless", False))


def ends(tree: Any) -> tuple[float, float]:
    """The end stops; of continuous rotation all that is watched, and a turn beyond."""
    if not endless(tree):
        return float(tree.load.stop_low), float(tree.load.stop_high)
    low, high = min(tree.travel.low, tree.guard.low), max(tree.travel.high, tree.guard.high)
    return float(low - TURN), float(high + TURN)


def gravity_at(tree: Any, place: float) -> float:
    """Gravity at a place, towards lower positions."""
    most, hangs = eccentric_load(tree)
    return weight(tree) + most * math.sin(place - hangs)


def heaviest(tree: Any) -> float:
    """Greatest gravity anywhere, of either sign."""
    return abs(weight(tree)) + eccentric_load(tree)[0]


def current(tree: Any) -> float:
    """Greatest current of amplifier, supply and D/A at rest."""
    amp = tree.amplifier
    most = min(amp.current, amp.supply / tree.motor.resistance)
    if amp.mode == CURRENT:
        return float(min(most, amp.transconductance * amp.full_scale))
    return float(min(most, amp.gain * amp.full_scale / tree.motor.resistance))


def force(tree: Any) -> float:
    """Greatest force at the load, at rest."""
    return current(tree) * constant(tree) * float(tree.drive.efficiency)


def per_newton(tree: Any) -> float:
    """Effort per force at the load, at rest."""
    push = constant(tree) * tree.drive.efficiency
    if tree.amplifier.mode == CURRENT:
        return float(1.0 / (push * tree.amplifier.transconductance))
    return float(tree.motor.resistance / (push * tree.amplifier.gain))


def breakaway_force(tree: Any) -> float:
    """Friction and weight to overcome upwards from rest."""
    rubbing = tree.friction
    return float(rubbing.coulomb + rubbing.stribeck + rubbing.ripple + heaviest(tree))


def sliding_force(tree: Any) -> float:
    """Friction and weight in upward motion, without the viscous part."""
    return float(tree.friction.coulomb + tree.friction.ripple + heaviest(tree))


def available_force(tree: Any) -> float:
    """Force left for acceleration in moves."""
    return max(SPARE * force(tree) - sliding_force(tree), 0.01 * force(tree))


def fastest(tree: Any) -> float:
    """Speed at which back-EMF and friction use up the share of the supply for moves."""
    amp = tree.amplifier
    volts = amp.supply
    if amp.mode != CURRENT:
        volts = min(volts, amp.gain * amp.full_scale)
    k = constant(tree)
    push = k * tree.drive.efficiency
    ohmic = tree.motor.resistance / push
    # SPARE V = R/K (coulomb + weight + viscous v) + K v
    v = (SPARE * volts - ohmic * sliding_force(tree)) / (k + ohmic * tree.friction.viscous)
    return float(max(v, 0.01 * SPARE * volts / k))


def lag(tree: Any) -> float:
    """All delays of the velocity loop: hold, computing, amplifier or winding."""
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
    """Force per speed of the motor, and the load's share of that speed, with a compliant drive."""
    load = moved * s + viscous
    if frequency <= 0.0:
        return rotor * s + load, np.ones_like(s)
    stiffness = moved * (2.0 * math.pi * frequency) ** 2
    spring = stiffness / s + 2.0 * damping * math.sqrt(stiffness * moved)
    seen = spring / (spring + load)
    return rotor * s + load * seen, seen


def plant(tree: Any, frequency: Array) -> Complex:
    """Linear position at the encoder per effort by the sheets, with hold and output delay."""
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
    found: Complex = speed / s * hold_and_delay(s, tree.timing)
    return found
