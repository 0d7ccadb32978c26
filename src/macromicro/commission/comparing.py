"""Gains by the rules and by a search, both tried on the stage itself: what arrives sooner stays.

A search looks at models alone, and strokes hardly show over which speed friction fades: what
settles sooner on every model may settle later on the stage.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from macromicro.commission import moves, verifying
from macromicro.commission.procedure import Kind, Step, Tuned
from macromicro.commission.stand import Stand
from macromicro.machines import machine as machines
from macromicro.machines import results

# Of the travel: neither those of the rehearsal, on which gains are searched, nor those that verify.
SHARES = (0.2, 0.75, 0.77, 0.5, 0.48, 0.12, 0.8, 0.25)
HOLD = 0.1  # s
BETTER = 0.95  # of what it takes by the rules: no less is worth other gains


class Compared(NamedTuple):
    """What the stage took by both gains.

    Attributes
    ----------
    rules, search : float
        As `settling` gives it, s.
    faults : tuple[str, ...]
        What the guard saw by the rules' and by the search's; "" for nothing.
    gains : tuple[str, ...]
        The search's: path and value, one after the other.
    """

    rules: float
    search: float
    faults: tuple[str, ...]
    gains: tuple[str, ...]


# Kept as the steps of a kind are; `running` says and does what depends on the gains.
STEP = Step("comparison", "both gains on the stage", lambda _: "", lambda _: None, Compared)


def kept(kind: Kind) -> tuple[Step, ...]:
    """What commissioning a kind leaves on disk, in the order in which it is done.

    Parameters
    ----------
    kind : Kind
        What is commissioned.

    Returns
    -------
    tuple[Step, ...]
        Its steps, and the comparison where it makes one.
    """
    return tuple(kind.steps) if kind.compare is None else (*kind.steps, STEP)


def better(after: float, before: float) -> bool:
    """Whether other gains are worth it.

    Parameters
    ----------
    after, before : float
        By these and by the rules, s; infinity where a move does not arrive.

    Returns
    -------
    bool
        False where neither arrives.
    """
    return after < math.inf and after <= BETTER * before


def settling(stand: Stand, machine: machines.Machine, settings: Any) -> tuple[float, str]:
    """How long the stage takes to settle after the end of a profile.

    Parameters
    ----------
    stand : Stand
        The stage, at the machine's 0.
    machine : machines.Machine
        Its kind and law.
    settings : Any
        Its settings.

    Returns
    -------
    mean : float
        Over all moves, s, at least 0; infinity where one does not arrive.
    fault : str
        What the guard saw; "" for nothing.
    """
    what = moves.programme("comparison", "moves by two sets of gains", SHARES, HOLD, settings)
    done = verifying.made(stand, machine, settings, what)
    if not done.met:
        return math.inf, done.fault
    return max(0.0, float(np.mean(results.settling(done.moves)))), ""


def listed(tuned: Tuned) -> tuple[str, ...]:
    """Gains, by which a comparison is known again.

    Parameters
    ----------
    tuned : Tuned
        What a search found.

    Returns
    -------
    tuple[str, ...]
        Path and value, one after the other.
    """
    return tuple(word for pair in tuned.gains.items() for word in pair)


def compared(tried: Callable[[Tuned], tuple[float, str]], tuned: Tuned) -> Compared:
    """Try both gains, the rules' first: they are surely sound.

    Parameters
    ----------
    tried : Callable[[Tuned], tuple[float, str]]
        Gives what `settling` does, by the gains of a search or, of `Tuned()`, by the rules.
    tuned : Tuned
        What the search found.

    Returns
    -------
    Compared
        What both took.
    """
    rules, fault_rules = tried(Tuned())
    search, fault_search = tried(tuned)
    return Compared(rules, search, (fault_rules, fault_search), listed(tuned))


def chosen(found: Compared, tuned: Tuned) -> Tuned:
    """The gains that stay.

    Parameters
    ----------
    found : Compared
        What the stage took.
    tuned : Tuned
        What the search found.

    Returns
    -------
    Tuned
        With what both took, in words; without gains where those by the rules stay.
    """
    before, after = found.rules, found.search
    doubts = tuple(
        f"By the gains of the {name} a guard ended the moves that compare them: {fault}"
        for name, fault in zip(("rules", "search"), found.faults, strict=True)
        if fault
    )
    what, unit = "settling on the stage", "s"
    if better(after, before):
        row = (what, f"{after:.3g}", f"{before:.3g} by the rules", unit)
        return tuned._replace(rows=(row, *tuned.rows), doubts=(*tuned.doubts, *doubts))
    row = (what, f"{before:.3g}", f"{after:.3g} by the search, whose gains are left out", unit)
    return Tuned(rows=(row,), doubts=(*tuned.doubts, *doubts))
