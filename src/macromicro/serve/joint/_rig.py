"""Two axes with their guards as the loop's guard."""

from __future__ import annotations

from macromicro.machines import guarding
from macromicro.rig.session import Session
from macromicro.serve import _lamps as lamps
from macromicro.serve import faults
from macromicro.serve.shared import NO_LINES
from macromicro.serve.snapshot import Trouble
from macromicro.serve.stage import rig as stage_rig
from macromicro.serve.stage.rig import Real, Simulated
from macromicro.types import ENABLE, Sample


class Led(stage_rig.Led):
    """A session with both axes and their guards."""

    def __init__(self, session: Session, rig: Simulated | Real) -> None:
        super().__init__(session, rig)
        self._both = rig

    @property
    def second(self) -> Sample:
        return self._both.shown[1]

    def lines(self) -> tuple[float, ...]:
        return NO_LINES

    def lamps(self) -> float:
        enable = {ENABLE: self._both.control.enable}
        return lamps.packed([
            {name: told for name, told in (said._asdict() | enable).items() if name in kind.lines}
            for kind, said in zip(self._both.kinds, self._both.lines, strict=True)
        ])  # fmt: skip

    def evidence(self) -> tuple[float, float, float, float]:
        k = self._both.control.faulty
        watch = self._both.control.watches[k]
        return float(faults.AXIS[k] + watch.fault), watch.value, watch.limit, watch.time

    def fault(self) -> tuple[Trouble, bool]:
        """The latched fault, and whether counts may have been missed."""
        control = self._both.control
        found = faults.of_axis(*self.evidence())
        return found, guarding.blind(control.watches[control.faulty])

    def overlooked(self) -> str:
        """Why a position may be wrong despite the latched fault, or ""."""
        missed = any(map(stage_rig.doubtful, self._both.control.watches))
        return stage_rig.MISSED if missed else ""
