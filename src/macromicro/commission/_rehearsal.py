"""Positioning tolerance of an identified axis, by simulated moves."""

# With friction and a lag in the loop, a slow axis with a fine encoder hunts about its target. Moves
# are simulated with drawn presliding friction, and the tolerance is the finest at which all arrive.

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from macromicro.commission import _moves
from macromicro.machines import machine as machines
from macromicro.machines import planning, results, runs
from macromicro.programme import Programme

SHARES = (0.3, 0.32, 0.7, 0.1)  # of the travel; others than those of the verification
HOLD = 0.1  # s
SPREAD = (0.5, 2.0)  # times the give before sliding, and the speed over which friction fades
WAIT = 0.5  # of the patience: what arrives later on the model may be late on the axis
COARSER = 1.4  # from one tolerance that is tried to the next
TRIES = 14  # up to some hundred times the finest


def programme(settings: Any) -> Programme:
    """Test moves, in counts."""
    return _moves.programme("rehearsal", "moves on the model", SHARES, HOLD, settings)


def drawn(settings: Any) -> Iterator[Any]:
    """The machine with other presliding friction under the same law."""
    friction = settings.friction
    for give in SPREAD:
        for fading in SPREAD:
            changed = friction._replace(
                presliding=give * friction.presliding,
                stribeck_speed=fading * friction.stribeck_speed,
            )
            yield settings._replace(friction=changed)


def arrives(machine: machines.Machine, settings: Any) -> bool:
    """Whether all moves arrive in time on all drawn machines."""
    what = programme(settings)
    plan, latest = planning.plan(what, settings), WAIT * settings.arrival.patience
    for seed, tree in enumerate(drawn(settings)):
        done = runs.record(machine, tree, plan, seed=seed, warn=False)
        if done.outcome.fault is not None:
            return False
        made = results.moves(done.recording, plan, settings.arrival, machine.kind.place)
        took = results.settling(made)
        if len(took) < len(SHARES) or max(took) > latest:
            return False
    return True


def rested(machine: machines.Machine, settings: Any) -> float | None:
    finest = float(settings.arrival.tolerance)
    for k in range(TRIES):
        tolerance = finest * COARSER**k
        tried = settings._replace(
            arrival=settings.arrival._replace(tolerance=tolerance),
            controller=settings.controller._replace(rest=0.5 * tolerance),
        )
        if arrives(machine, tried):
            return tolerance if k else None
    return None
