"""Rule-based and searched gains tried on the stage itself; the faster ones are kept."""

# A search uses models, which hardly know how friction fades with speed, so it may be slower on the
# stage.

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from macromicro.commission import _moves, _verifying
from macromicro.commission.procedure import Kind, Step, Tuned
from macromicro.commission.stand import Stand
from macromicro.machines import machine as machines
from macromicro.machines import results

# Of the travel: neither those of the rehearsal, on which gains are searched, nor those that verify.
SHARES = (0.2, 0.75, 0.77, 0.5, 0.48, 0.12, 0.8, 0.25)
HOLD = 0.1  # s
BETTER = 0.95  # of what it takes by the rules: no less is worth other gains


class Compared(NamedTuple):
    # rules, search: as `settling` gives it, s
    rules: float
    search: float
    faults: tuple[str, ...]  # of a guard with the rules' and the search's gains; "" for none
    gains: tuple[str, ...]  # the search's: path and value, one after the other


# Kept as the steps of a kind are; `running` says and does what depends on the gains.
STEP = Step("comparison", "both gains on the stage", lambda _: "", lambda _: None, Compared)


def kept(kind: Kind) -> tuple[Step, ...]:
    """Results of a kind that are saved, in order."""
    return tuple(kind.steps) if kind.compare is None else (*kind.steps, STEP)


def better(after: float, before: float) -> bool:
    """Whether other gains are worth the change."""
    return after < math.inf and after <= BETTER * before


def settling(stand: Stand, machine: machines.Machine, settings: Any) -> tuple[float, str]:
    """Settling time after the end of a profile."""
    what = _moves.programme("comparison", "moves by two sets of gains", SHARES, HOLD, settings)
    done = _verifying.made(stand, machine, settings, what)
    if not done.met:
        return math.inf, done.fault
    return max(0.0, float(np.mean(results.settling(done.moves)))), ""


def listed(tuned: Tuned) -> tuple[str, ...]:
    """Gains that identify a comparison."""
    return tuple(word for pair in tuned.gains.items() for word in pair)


def compared(tried: Callable[[Tuned], tuple[float, str]], tuned: Tuned) -> Compared:
    """Try both gains, the rules' first, which are safe."""
    rules, fault_rules = tried(Tuned())
    search, fault_search = tried(tuned)
    return Compared(rules, search, (fault_rules, fault_search), listed(tuned))


def chosen(found: Compared, tuned: Tuned) -> Tuned:
    before, after = found.rules, found.search
    doubts = tuple(
        f"With the gains of the {name}, a guard stopped the comparison: {fault}"
        for name, fault in zip(("rules", "search"), found.faults, strict=True)
        if fault
    )
    what, unit = "settling on the stage", "s"
    if better(after, before):
        row = (what, f"{after:.3g}", f"{before:.3g} {unit} by the rules", unit)
        return tuned._replace(rows=(row, *tuned.rows), doubts=(*tuned.doubts, *doubts))
    row = (
        what,
        f"{before:.3g}",
        f"{after:.3g} {unit} by the search, whose gains are rejected",
        unit,
    )
    return Tuned(rows=(row,), doubts=(*tuned.doubts, *doubts))
