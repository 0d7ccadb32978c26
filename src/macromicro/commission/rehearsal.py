"""How finely an axis that was found comes to rest, by moves of the model itself.

Friction holds what stands, and a loop that lags meets what it lets go only some way later: a slow
axis with a fine encoder steps to and fro across its target, and never stays within a few counts. So
the moves are rehearsed on the model before they are made, with what the strokes do not show drawn
either way, and the tolerance is the finest at which all of them arrive.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from macromicro.commission import moves
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
    """Moves, long and short.

    Parameters
    ----------
    settings : Any
        With travel and encoder.

    Returns
    -------
    Programme
        Targets in counts.
    """
    return moves.programme("rehearsal", "moves on the model", SHARES, HOLD, settings)


def drawn(settings: Any) -> Iterator[Any]:
    """The machine with another friction before it slides, under the same law.

    Parameters
    ----------
    settings : Any
        Of an axis.

    Yields
    ------
    Any
        Settings.
    """
    friction = settings.friction
    for give in SPREAD:
        for fading in SPREAD:
            changed = friction._replace(
                presliding=give * friction.presliding,
                stribeck_speed=fading * friction.stribeck_speed,
            )
            yield settings._replace(friction=changed)


def arrives(machine: machines.Machine, settings: Any) -> bool:
    """Whether all moves arrive in good time, on all machines that are drawn.

    Parameters
    ----------
    machine : machines.Machine
        The machine.
    settings : Any
        Of it.

    Returns
    -------
    bool
        False for a fault, too.
    """
    what = programme(settings)
    plan, latest = planning.plan(what, settings), WAIT * settings.arrival.patience
    for seed, tree in enumerate(drawn(settings)):
        done = runs.record(machine, tree, plan, seed=seed)
        if done.outcome.fault is not None:
            return False
        made = results.moves(done.recording, plan, settings.arrival, machine.kind.place)
        took = results.settling(made)
        if len(took) < len(SHARES) or max(took) > latest:
            return False
    return True


def rested(machine: machines.Machine, settings: Any) -> float | None:
    """The tolerance within which the model comes to rest.

    Parameters
    ----------
    machine : machines.Machine
        The machine.
    settings : Any
        Of it, with the finest tolerance that its encoder allows.

    Returns
    -------
    float | None
        m; None where the finest will do, or none that was tried does.
    """
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
