"""How an axis with an incremental encoder finds its place: from its data sheets."""

from __future__ import annotations

import math
from typing import Any

from macromicro.control.live.leading import Touch
from macromicro.machines.sheets import force, mass, per_newton, weight

SHARE = 0.9  # of the guard's push, under which the stage has to move
EMF = 0.35  # of the effort, for the back-EMF: kinetic friction takes less than 0.56 of it
STAND = 0.3  # s; shortest standstill that is taken for the stop
FAST, SLOW = 0.1, 0.01  # of the greatest speed
PATIENCE = 5.0  # times what the whole way takes


def touch(tree: Any) -> Touch:
    """How an axis feels for its lower end stop.

    The effort starts it against friction and weight, and is below what the guard takes for a
    stage that is stuck. At the speed of the search the back-EMF takes its share of that effort,
    and what runs into the stop, of stiffness k, pushes it no harder than the motor can:
    v sqrt(m k). Leaning on the stop the stage stands where that has given way to what friction
    and weight leave of the effort.

    Parameters
    ----------
    tree : Any
        Settings of an axis.

    Returns
    -------
    Touch
        For `control.live.touching`.
    """
    law, load = tree.controller, tree.load
    effort = SHARE * tree.guard.push
    push = effort / per_newton(tree)
    by_emf = EMF * effort / max(law.ahead_velocity, 1e-12)
    by_stop = force(tree) / math.sqrt(mass(tree) * load.stop_stiffness)
    speed = min(FAST * tree.motion.velocity, by_emf, by_stop)
    # As far ahead as the law needs for the effort, within half of what the guard allows.
    lead = min(0.5 * tree.guard.error, 2.0 * effort / (law.velocity * law.position))
    wound = effort / (law.velocity * law.integral * law.position * lead)
    leans = max(push - tree.friction.coulomb + weight(tree), 0.0) / load.stop_stiffness
    way = load.stop_high - load.stop_low
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
        place=load.stop_low - leans,
        patience=PATIENCE * (way / speed + back / min(slow, speed)) + 10.0,
    )
