"""Several stages with their guards as the loop's guard."""

from __future__ import annotations

from macromicro.machines import guarding
from macromicro.rig.session import Session
from macromicro.serve import faults
from macromicro.serve.snapshot import Trouble
from macromicro.serve.stage import rig as stage_rig
from macromicro.serve.stage.rig import Real, Simulated


class Led(stage_rig.Led):
    """A session with all stages and their guards."""

    def __init__(self, session: Session, rig: Simulated | Real, axes: faults.Axes) -> None:
        super().__init__(session, rig)
        self._axes = axes

    def lines(self) -> tuple[float, ...]:
        """They have no columns."""
        return ()

    def evidence(self) -> tuple[float, float, float, float]:
        k = self._control.faulty
        watch = self._control.watches[k]
        return float(faults.AXIS + 100 * k + watch.fault), watch.value, watch.limit, watch.time

    def fault(self) -> tuple[Trouble, bool]:
        """The latched fault, and whether counts may have been missed."""
        control = self._control
        found = faults.of_axis(*self.evidence(), self._axes)
        return found, guarding.blind(control.watches[control.faulty])

    def overlooked(self) -> str:
        """Why a position may be wrong despite the latched fault, or ""."""
        missed = any(map(stage_rig.doubtful, self._control.watches))
        return stage_rig.MISSED if missed else ""
