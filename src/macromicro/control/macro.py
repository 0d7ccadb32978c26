"""The macro-stage's control laws, chosen by number: a new one is one file and one line here."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.control import deadzone, pd, pid
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pid import Pid
from macromicro.kernel import kernel

LAWS = ("pid", "pd-initial", "pd-tuned")
COMPENSATED = (False, True, True)  # as the thesis runs them


class MacroLaw(NamedTuple):
    """Which law, with which gains; dead_zone [V] 0 leaves the friction uncompensated."""

    law: int
    dead_zone: float
    limit: float
    pid: Pid
    initial: PdInitial
    tuned: PdTuned


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
        effort = pd.step(p.initial.now, p.initial.before, error, s.error)
    else:
        effort = pd.step(p.tuned.now, p.tuned.before, error, s.error)
    if p.dead_zone > 0.0:
        effort = deadzone.inverse(p.dead_zone, effort)
    effort = min(max(effort, -p.limit), p.limit)
    return MacroMemory(integral, error), effort
