"""The live machine of one stage as the loop drives it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from macromicro.control.live import guided, state
from macromicro.control.live import messages as m
from macromicro.control.live.leading import Course, Guide, Guided
from macromicro.control.live.messages import Notice, Refused, Reply
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.surveying import Surveying
from macromicro.serve.live import Live
from macromicro.serve.persist import Restored
from macromicro.types import QUIET, SAFE, Command, Lines, Outputs, Sample

_FROM_FILE = Refused(
    "the gains of this machine are those of its settings file",
    "set them there ([controller]), and start again",
)
_NO_PROGRAMME = Refused(
    "this machine takes single moves live", "`macromicro run` runs programmes on it"
)
_ABSOLUTE = Refused("this machine's sensor is absolute: its place is known", "move it")


class Led(Live):
    """A `serve.machine.Machine` whose motions are set points for the law of its stage.

    `course`: what the law is given for the present period; `lines`: where what the switches say
    comes from.
    """

    def __init__(self, parameters: LiveParameters, guide: Guide, dt: float) -> None:
        self._p, self._guide = parameters, guide
        self._s, self._g = state.begin(parameters), Guided()
        q = parameters.settings
        self._look = Surveying(q.edges, q.pitch, dt)
        self.course = Course()
        self.lines: Callable[[], Lines] = lambda: QUIET

    def begin(self, sample: Sample, restored: Restored) -> None:
        """The stage stands where it was left, if that is known; an absolute sensor knows it."""
        self._g, self.course = Guided(), Course()
        if self.searches:
            super().begin(sample, restored)
            return
        s = state.begin(self._p, sample.encoder, trusted=True)
        self._s = s._replace(frame=s.frame._replace(carriage=False))

    @property
    def searches(self) -> bool:
        """Has it to home before its place is known?"""
        return self._guide.touch is not None

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]:
        """One control period."""
        self._s, self._g, self.course, notices = guided.step(
            self._p, self._guide, self._s, self._g, sample, dt, self._look, self.lines()
        )
        reference = self.course.aim.position / self._p.settings.pitch
        on = 1.0 if self.course.on else 0.0
        return Command(reference, on, 0.0, 0.0, 0.0), SAFE, notices

    def accept(self, request: Any) -> tuple[Reply, tuple[Notice, ...]]:
        """A request, between two periods."""
        refused = self._unable(request)
        return (refused, ()) if refused is not None else super().accept(request)

    def refusal(self, request: Any) -> Refused | None:
        """Why it would be refused now."""
        return self._unable(request) or super().refusal(request)

    def _unable(self, request: Any) -> Refused | None:
        if isinstance(request, m.SetGains):
            return _FROM_FILE
        if isinstance(request, m.Programme):
            return _NO_PROGRAMME
        if isinstance(request, m.Home) and not self.searches:
            return _ABSOLUTE
        return None
