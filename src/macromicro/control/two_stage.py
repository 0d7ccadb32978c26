"""The positioner's controller as an object: the supervisor's kernel behind `Controller`."""

from __future__ import annotations

from collections.abc import Callable

from macromicro.control import supervisor
from macromicro.control.supervisor import DONE, Plan, Progress, Supervisor
from macromicro.types import Command, Outputs, Sample

Step = Callable[[Supervisor, Plan, Progress, Sample, float], tuple[Progress, Command, Outputs]]


class TwoStage:
    """Macro, then micro (Figure 6.1).

    Parameters
    ----------
    params : Supervisor
        The supervisor's.
    kernel : Step, optional
        Its step; the compiled one may be passed for speed.
    """

    def __init__(self, params: Supervisor, kernel: Step = supervisor.step) -> None:
        self.params = params
        self._step = kernel

    def step(
        self, state: Progress, reference: Plan, sample: Sample, dt: float
    ) -> tuple[Progress, Command, Outputs]:
        """One control period.

        Parameters
        ----------
        state : Progress
            State of the supervisor.
        reference : Plan
            The programme.
        sample : Sample
            What the rig shows.
        dt : float
            Control period, s.

        Returns
        -------
        state : Progress
            New state.
        command : Command
            What is being asked for.
        outputs : Outputs
            What the guard is to judge.
        """
        return self._step(self.params, reference, state, sample, dt)

    def finished(self, state: Progress) -> bool:
        """Whether the plan has come to its end.

        Parameters
        ----------
        state : Progress
            State of the supervisor.

        Returns
        -------
        bool
            True if so.
        """
        return state.phase == DONE
