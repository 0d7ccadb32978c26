"""Homing parameters of an axis, from its data sheets."""

from __future__ import annotations

import math
from typing import Any

from macromicro.control.live.leading import Seek, Touch
from macromicro.machines import _wiring, pace
from macromicro.machines.parts import CAM, HOME, INDEX, LOW_LIMIT, START, STOP
from macromicro.machines.sheets import (
    breakaway_force,
    endless,
    ends,
    force,
    gravity_at,
    lag,
    mass,
    per_newton,
)

SHARE = 0.9  # of the guard's push, under which the stage has to move
EMF = 0.35  # share of the effort for the back-EMF; kinetic friction takes less than 0.56
REVEAL, SURELY = 0.05, 4.0  # s at least, and times what a free stage takes to move `still`
STAND = 0.3  # s; shortest standstill that is taken for the stop
FAST, SLOW = 0.1, 0.01  # of the greatest speed
PATIENCE = 5.0  # times the duration of the whole travel
SURE = 4.0  # standard deviations of a switch within which its edge lies
LINES = {HOME: "home", LOW_LIMIT: "limit_low"}
BRISK = 10.0  # times the speed of the touch, off a switch and to an index pulse


def touch(tree: Any) -> Touch | None:
    """Homing as `homing.on` chooses."""
    if tree.homing.on == START:
        return None
    return stop(tree) if tree.homing.on == STOP else _seek(tree)


def _seek(tree: Any) -> Touch:
    """Effort and lead as for the stop, speeds and distances by the switch."""
    found, on = stop(tree), tree.homing.on
    away, way = back(tree), _way(tree)
    apart = _wiring.spacing(tree)
    fast, gentle = speed(tree), slow(tree)
    seek = Seek(
        line=LINES.get(on.split("+")[0], ""),
        above=on.startswith(HOME) and tree.switches.home == CAM,
        pulse=INDEX in on,
        spacing=apart,
        margin=margin(tree),
        rise=min(fast, BRISK * gentle),
    )
    return found._replace(
        speed=fast,
        slow=gentle,
        back=away,
        place=pulse(tree) if seek.pulse else edge(tree),
        out=pulse(tree) if endless(tree) else found.out,
        patience=PATIENCE * (2.0 * way / fast + away / gentle + way / seek.rise) + 10.0,
        seek=seek,
    )


def _way(tree: Any) -> float:
    """The longest search: stop to stop, or 1.5 turns without ends."""
    if endless(tree):
        return 3.0 * math.pi
    return float(tree.load.stop_high - tree.load.stop_low)


def edge(tree: Any) -> float:
    """Where the homing switch trips."""
    limit = tree.homing.on.startswith(LOW_LIMIT)
    return float(tree.switches.low if limit else tree.switches.home_place)


def pulse(tree: Any) -> float:
    """The index pulse of the home position: the mark, or the first above the switch."""
    place, apart = float(tree.encoder.index_place), _wiring.spacing(tree)
    if apart == 0.0 or tree.homing.on == INDEX:
        return place
    return place + apart * math.ceil((edge(tree) - place) / apart)


def margin(tree: Any) -> float:
    """Uncertainty of the switch's edge."""
    scatter = SURE * tree.switches.repeatability
    return float(scatter + slow(tree) * pace.period(tree) + 2.0 * tree.encoder.pitch)


def speed(tree: Any) -> float:
    fast = stop(tree).speed
    room = tree.switches.low - tree.load.stop_low
    if tree.homing.on.startswith(LOW_LIMIT) and room > 0.0:
        fast = min(fast, math.sqrt(tree.motion.acceleration * room))
    return float(fast)


def slow(tree: Any) -> float:
    """Speed of the touch that counts: at most the switch's scatter, or a count, per period."""
    fine = max(tree.switches.repeatability, tree.encoder.pitch) / pace.period(tree)
    return float(min(stop(tree).slow, fine, speed(tree)))


def back(tree: Any) -> float:
    """Backing distance before the second touch."""
    rise = min(speed(tree), BRISK * slow(tree))
    turning = rise * rise / tree.motion.acceleration
    return float(SURE * tree.switches.repeatability + turning + 4.0 * tree.encoder.pitch)


def stop(tree: Any) -> Touch:
    """Parameters for finding the lower end stop by touch.

    The effort moves a free stage and stays below the guard's limit for a stuck one. The impact,
    with stop stiffness k, must not exceed the motor's force: v sqrt(m k).
    """
    law, load, low = tree.controller, tree.load, ends(tree)[0]
    effort = SHARE * tree.guard.push
    push = effort / per_newton(tree)
    by_emf = EMF * effort / max(law.ahead_velocity, 1e-12)
    by_stop = force(tree) / math.sqrt(mass(tree) * load.stop_stiffness)
    speed = min(FAST * tree.motion.velocity, by_emf, by_stop)
    # The lead that the law needs for the effort, within half of the guard's limit.
    lead = min(0.5 * tree.guard.error, 2.0 * effort / (law.velocity * law.position))
    wound = effort / (law.velocity * law.integral * law.position * lead)
    weighs = gravity_at(tree, low)
    leans = max(push - tree.friction.coulomb + weighs, 0.0) / load.stop_stiffness
    way = _way(tree)
    give = max(4.0 * tree.encoder.pitch, tree.arrival.tolerance)
    slow = max(SLOW * tree.motion.velocity, 2.0 * give / STAND)
    back = max(4.0 * give + 2.0 * leans, 0.01 * way)
    return Touch(
        speed=speed,
        slow=min(slow, speed),
        effort=effort,
        lead=lead,
        stand=max(STAND, 2.0 * wound),
        give=give,
        back=back,
        place=low - leans,
        patience=PATIENCE * (way / speed + back / min(slow, speed)) + 10.0,
        reveal=reveal(tree),
    )


def reveal(tree: Any) -> float:
    """Time in which a free stage moves visibly under the guard's `lean`."""
    left = tree.guard.lean / per_newton(tree) - breakaway_force(tree)
    takes = math.sqrt(2.0 * mass(tree) * tree.guard.still / left) if left > 0.0 else STAND
    return float(max(REVEAL, SURELY * (takes + lag(tree))))
