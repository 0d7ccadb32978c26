"""Derived settings of an axis: `RULES` in an order in which none depends on a later one."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

from macromicro.control.notch import Notch
from macromicro.machines import loops
from macromicro.machines._rounding import round_to as _round
from macromicro.machines.homing import reveal
from macromicro.machines.parts import LOW_LIMIT, MOTOR, TURN
from macromicro.machines.sheets import (
    SPARE,
    available_force,
    breakaway_force,
    constant,
    eccentric_load,
    ends,
    fastest,
    force,
    lag,
    mass,
    per_newton,
    plant,
    turn,
    turning,
    weight,
)
from macromicro.machines.tree import Rule
from macromicro.plant.power import CURRENT
from macromicro.plant.transmission import LINEAR

BESIDE, BEYOND = 0.3, 0.2  # of a flexible mode, encoder on the motor or at the load
NOTCHED = 0.5  # the same with a notch at the resonance
STRAYS = 0.05  # of a resonance under a notch: so far beside the notch it may lie
MARGIN = 0.02  # of the way between the stops that stays free at either end
FINEST = 50e-6  # s; longest step of the physics
COUNTED = 0.15  # share of the effort that one count's step may take
OUTER, OBSERVER = 0.25, 7.0  # position loop and observer, to the velocity loop's bandwidth
STARTS, LESS = 1.5, 0.8  # of what starts the stage, and of guard.push: guard.lean
SURGE = 20.0  # times the motor's acceleration, which also blows and stops do not exceed
LIGHT = 1e-3  # of the greatest effort: guard.push of a stage without friction
SOON = 0.1  # s, or twice what a free stage needs to move: guard.leant
LEAP = 3.0  # times the greatest speed that the motor can reach
ROOM = 0.33  # rad; phase that all delays may take at the velocity loop's bandwidth

_TRIES = 40


def _velocity(tree: Any) -> float:
    """Speed at 0.7 of the motor's supply, within encoder and travel."""
    way = tree.travel.high - tree.travel.low
    # The acceleration takes 0.6 of the force that is left: viscous friction may take 0.3.
    by_force = 0.3 * available_force(tree) / max(tree.friction.viscous, 1e-12)
    by_way = math.sqrt(max(way, 1e-9) * available_force(tree) / mass(tree))
    by_counter = 0.8 * tree.encoder.rate * tree.encoder.pitch
    return _round(min(0.9 * fastest(tree), by_counter, by_way, by_force))


def _acceleration(tree: Any) -> float:
    # At the greatest speed the back-EMF leaves less of the supply: half is for that.
    return _round(0.6 * available_force(tree) / mass(tree))


def bandwidth(tree: Any) -> float:
    """Bandwidth of the velocity loop, limited by delays, flexibility and encoder."""
    by_lag = ROOM / lag(tree)
    found = by_lag
    if tree.drive.frequency > 0.0:
        beyond = tree.encoder.at != MOTOR  # the mode lies between motor and encoder
        share = BEYOND if beyond else BESIDE
        notch = getattr(tree.controller, "notch", loops.NO_NOTCH)
        if notch.frequency > 0.0:
            share = max(share, NOTCHED)
        found = min(found, share * 2.0 * math.pi * tree.drive.frequency)
        found = _robust(tree._replace(controller=None, guard=None, motion=None), notch, found)
    # A count's step through observer and velocity gain stays below COUNTED of the effort:
    # per_newton mass w (observer pitch) with the observer at OBSERVER w.
    step = OBSERVER * per_newton(tree) * mass(tree) * tree.encoder.pitch
    by_count = math.sqrt(COUNTED * tree.controller.limit / step)
    return min(found, by_count)


@lru_cache(maxsize=256)
def _robust(tree: Any, notch: Notch, most: float) -> float:
    """The greatest bandwidth that keeps the modulus margin, also with a notch off its mode."""
    dt = tree.timing.period
    frequency = loops.grid(dt, 1e-6 * most)
    per_speed, w = per_newton(tree) * mass(tree), most
    sides = (0.0,) if notch.frequency <= 0.0 else (-STRAYS, 0.0, STRAYS)
    bodies = [
        plant(tree._replace(drive=tree.drive._replace(frequency=one)), frequency)
        for one in (tree.drive.frequency * (1.0 + side) for side in sides)
    ]
    for _ in range(_TRIES):
        law = loops.law(loops.gains(w, per_speed, OUTER, OBSERVER, notch), frequency, dt)
        if min(loops.modulus(body * law) for body in bodies) >= loops.MODULUS:
            break
        w *= 0.85
    return w


def _pitch(tree: Any) -> float:
    if tree.encoder.at != MOTOR or tree.drive.kind == LINEAR:
        return 1.0e-6
    return float(round(turn(tree) / (4.0 * tree.encoder.lines), 15))


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
    return min(_round(tree.load.stop_low + MARGIN * way), 0.0)


def _friction_volts(tree: Any) -> float:
    return _round(per_newton(tree) * tree.friction.coulomb)


def _loosen(tree: Any) -> float:
    """As ahead; none if the motor oscillates on a flexible drive while the load sticks."""
    return 0.0 if tree.drive.frequency > 0.0 else _friction_volts(tree)


def _ahead_velocity(tree: Any) -> float:
    emf = 0.0 if tree.amplifier.mode == CURRENT else constant(tree) / tree.amplifier.gain
    return _round(emf + per_newton(tree) * tree.friction.viscous)


def _soft(tree: Any, way: float) -> float:
    """Half way from the travel's end to the stop."""
    if way < 0.0:
        return _round(0.5 * (tree.travel.low + tree.load.stop_low))
    return _round(0.5 * (tree.travel.high + tree.load.stop_high))


def _along(tree: Any, share: float) -> float:
    """A place between the targets' ends."""
    return _round(tree.travel.low + share * (tree.travel.high - tree.travel.low))


def _index(tree: Any) -> float:
    """Half a turn above the homing edge; a mark a little above it."""
    limit = tree.homing.on.startswith(LOW_LIMIT)
    edge = tree.switches.low if limit else tree.switches.home_place
    if tree.encoder.index_pulse == TURN and tree.drive.kind != LINEAR:
        return _round(edge + 0.5 * turn(tree), 9)
    return _round(max(edge, tree.travel.low) + 0.02 * (tree.travel.high - tree.travel.low), 9)


def _following(tree: Any) -> float:
    """The lag of the position loop at maximum speed without feed-forward, or 20 tolerances."""
    slow = tree.motion.velocity / max(tree.controller.position, 1e-9)
    return _round(max(slow, 20.0 * tree.arrival.tolerance))


def let_go(tree: Any) -> float:
    """The finest position error that the axis settles to without hunting.

    Breakaway exceeds sliding friction by Stribeck's drop. The velocity loop compensates the
    difference only a lag later: at best the axis stands half of that distance to either side.
    """
    if tree.controller.velocity <= 0.0:
        return 0.0
    speed = per_newton(tree) * tree.friction.stribeck / tree.controller.velocity
    return float(0.5 * lag(tree) * speed)


def smallest_error(tree: Any) -> float:
    """The least error that the encoder shows for certain."""
    return float(max(4.0 * tree.encoder.pitch, 4.0 * tree.encoder.noise, 1.0e-7))


def nearest(tree: Any) -> tuple[tuple[float, str], ...]:
    """What limits the accuracy of an axis at rest."""
    # Within a slack nothing holds the load that is measured.
    slack = tree.drive.backlash if tree.encoder.at != MOTOR else 0.0
    creep = 0.0
    if tree.drive.frequency > 0.0:
        # Error whose integral breaks the friction within a quarter of the patience.
        p, quarter = tree.controller, 0.25 * tree.arrival.patience
        breaks = per_newton(tree) * (tree.friction.coulomb + tree.friction.stribeck)
        creep = breaks / max(p.velocity * p.integral * p.position * quarter, 1e-12)
    return (
        (smallest_error(tree), "four counts of the encoder, or four times its noise"),
        (slack, "the slack of the drive (drive.backlash)"),
        (
            creep,
            f"the slow integral against friction that a mode of {tree.drive.frequency:g} Hz "
            "(drive.frequency) allows",
        ),
        (let_go(tree), "the drop of friction at breakaway (friction.stribeck)"),
    )


def _tolerance(tree: Any) -> float:
    """Limited by resolution, and by friction under the law."""
    return _round(max(error for error, _ in nearest(tree)))


def _jerk(tree: Any) -> float:
    """The jerk that changes the acceleration within the velocity loop's response time."""
    rate = 0.25 * bandwidth(tree)
    if tree.drive.frequency > 0.0:
        rate = min(rate, 0.5 * tree.drive.frequency)
    return _round(tree.motion.acceleration * rate)


def _push(tree: Any) -> float:
    """Twice the holding effort, and a minimum."""
    holds = max(2.0 * per_newton(tree) * breakaway_force(tree), LIGHT * tree.guard.effort)
    return _round(min(holds, 0.95 * tree.guard.effort))


def _lean(tree: Any) -> float:
    """1.5 times the breakaway effort, below the push of homing."""
    starts = STARTS * per_newton(tree) * breakaway_force(tree)
    return _round(min(starts, LESS * tree.guard.push))


def _surge(tree: Any) -> float:
    """A multiple of the acceleration of the drive's lighter end."""
    moved = mass(tree)
    if tree.drive.frequency > 0.0:
        ends = (turning(tree), tree.load.mass + tree.load.payload)
        moved = max(min(ends), 1e-3 * moved)
    return _round(SURGE * force(tree) / moved)


def _still(tree: Any) -> float:
    """Two counts, and noise."""
    return _round(2.0 * tree.encoder.pitch + 8.0 * tree.encoder.noise)


def _against(tree: Any) -> float:
    """Twice the braking distance from maximum speed."""
    braking = tree.motion.velocity**2 / tree.motion.acceleration
    return _round(braking + 5.0 * tree.guard.still)


RULES: tuple[Rule, ...] = (
    ("amplifier.gain", lambda t: _round(t.amplifier.supply / t.amplifier.full_scale, 12)),
    (
        "amplifier.transconductance",
        lambda t: _round(t.amplifier.current / t.amplifier.full_scale, 12),
    ),
    ("encoder.pitch", _pitch),
    ("timing.steps", _steps),
    ("travel.low", _low),
    (
        "travel.high",
        lambda t: _round(t.load.stop_high - MARGIN * (t.load.stop_high - t.load.stop_low)),
    ),
    ("motion.velocity", _velocity),
    ("motion.acceleration", _acceleration),
    ("guard.effort", lambda t: t.amplifier.full_scale),
    ("controller.limit", lambda t: t.guard.effort),
    ("controller.velocity", lambda t: _round(per_newton(t) * mass(t) * bandwidth(t))),
    ("controller.integral", lambda t: _round(OUTER * bandwidth(t))),
    ("controller.position", lambda t: _round(OUTER * bandwidth(t))),
    ("controller.observer", lambda t: _round(OBSERVER * bandwidth(t))),
    ("controller.ahead_velocity", _ahead_velocity),
    ("controller.ahead_acceleration", lambda t: _round(per_newton(t) * mass(t))),
    ("controller.ahead_friction", _friction_volts),
    ("controller.loosen", _loosen),
    ("controller.ahead_gravity", lambda t: _round(per_newton(t) * weight(t))),
    ("controller.ahead_unbalance", lambda t: _round(per_newton(t) * eccentric_load(t)[0])),
    ("controller.hangs", lambda t: eccentric_load(t)[1]),
    ("arrival.tolerance", _tolerance),
    ("controller.rest", lambda t: _round(0.5 * t.arrival.tolerance)),
    ("motion.jerk", _jerk),
    ("guard.low", lambda t: _soft(t, -1.0)),
    ("guard.high", lambda t: _soft(t, 1.0)),
    ("guard.speed", lambda t: _round(1.5 * t.motion.velocity)),
    ("guard.error", _following),
    ("switches.low", lambda t: _round(0.5 * (t.guard.low + ends(t)[0]))),
    ("switches.high", lambda t: _round(0.5 * (t.guard.high + ends(t)[1]))),
    ("switches.home_place", lambda t: _along(t, 0.05)),
    ("switches.home_width", lambda t: _round(0.02 * (t.travel.high - t.travel.low))),
    ("switches.leave", lambda t: _round(0.1 * t.motion.velocity)),
    ("encoder.index_place", _index),
    ("amplifier.continuous", lambda t: _round(0.5 * t.amplifier.current)),
    ("guard.push", _push),
    ("guard.lean", _lean),
    ("guard.still", _still),
    ("guard.against", _against),
    ("guard.leant", lambda t: _round(max(SOON, 2.0 * reveal(t)))),
    ("guard.surge", _surge),
    ("guard.leap", lambda t: _round(LEAP * max(fastest(t) / SPARE, t.motion.velocity))),
)
