"""The macro-stage's control laws, chosen by number: a new one is one file and one line here."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.control import deadzone, pd, pid
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pid import Pid
from macromicro.kernel import kernel

LAWS = ("pid", "pd-initial", "pd-tuned")
UNCOMPENSATED = ("pid",)  # as the thesis runs them; a new law has the dead-zone inverse
COMPENSATED = tuple(law not in UNCOMPENSATED for law in LAWS)


class MacroLaw(NamedTuple):
    """Which law; dead_zone [V] 0 leaves the friction uncompensated. Then the gains of each law,
    in the order and under the names of `settings.Control`."""

    law: int
    dead_zone: float
    limit: float
    pid: Pid
    pd_initial: PdInitial
    pd_tuned: PdTuned


class MacroMemory(NamedTuple):
    """Integral effort [V] and last error [counts]."""

    integral: float
    error: float


@kernel
def step(p: MacroLaw, s: MacroMemory, error: float, dt: float) -> tuple[MacroMemory, float]:
    """Effort [V at the D/A] for an error [counts], saturated at `limit`."""
    integral = s.integral
    if p.law == 0:
        integral, effort = pid.step(p.pid, s.integral, error, s.error, dt)
    elif p.law == 1:
        effort = pd.step(p.pd_initial.now, p.pd_initial.before, error, s.error)
    else:
        effort = pd.step(p.pd_tuned.now, p.pd_tuned.before, error, s.error)
    return MacroMemory(integral, error), sent(effort, p.dead_zone, p.limit)


@kernel
def sent(effort: float, dead_zone: float, limit: float) -> float:
    """The effort [V] of a law, lifted over the dead zone [V] and saturated."""
    if dead_zone > 0.0:
        effort = deadzone.inverse(dead_zone, effort)
    return min(max(effort, -limit), limit)
