"""The two-stage controller as an object: the supervisor's kernel behind `Controller`."""

from __future__ import annotations

from collections.abc import Callable

from macromicro.control import supervisor
from macromicro.control.supervisor import DONE, Plan, Progress, Supervisor
from macromicro.types import Command, Outputs, Sample

Step = Callable[[Supervisor, Plan, Progress, Sample, float], tuple[Progress, Command, Outputs]]


class TwoStage:
    """Macro, then micro (Figure 6.1)."""

    def __init__(self, params: Supervisor, kernel: Step = supervisor.step) -> None:
        self.params = params
        self._step = kernel

    def step(
        self, state: Progress, reference: Plan, sample: Sample, dt: float
    ) -> tuple[Progress, Command, Outputs]:
        return self._step(self.params, reference, state, sample, dt)

    def finished(self, state: Progress) -> bool:
        return state.phase == DONE
