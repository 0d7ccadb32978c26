"""The live machine of one stage as the loop drives it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from macromicro.control.live import accept, alone, gains, guided, state, targets, transitions
from macromicro.control.live import messages as m
from macromicro.control.live.leading import Course, Guide, Guided
from macromicro.control.live.messages import Accepted, Notice, Refused, Reply
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.plain import shown
from macromicro.control.live.state import LiveState, Motion, Played
from macromicro.control.live.surveying import Surveying
from macromicro.machines import tree as trees
from macromicro.machines.parts import START
from macromicro.serve.live import Live
from macromicro.serve.machine import View
from macromicro.serve.persist import Restored
from macromicro.serve.stage import playing
from macromicro.types import QUIET, SAFE, Command, Lines, Outputs, Sample

_WORKS = {**guided.WORKS, Played: playing.step}
_ABSOLUTE = Refused(
    "this machine's place is known: by an absolute sensor, or from where it was switched on",
    "move it",
)


class Led(Live):
    """A `serve.machine.Machine` whose motions are set points for the law of its stage.

    `tree`: settings of the machine; `take`: gives the law new gains; `course`: what the law is
    given for the present period; `lines`: where what the switches say comes from; `leaning`: for
    how long the guard has seen the stage stand under a push [s]; `guide`: what leads it, which
    whoever joins two of them may change for a motion; `works`: how each kind of motion is carried
    out.
    """

    def __init__(
        self,
        parameters: LiveParameters,
        guide: Guide,
        dt: float,
        tree: Any,
        take: Callable[[Any], None],
    ) -> None:
        self._p, self.guide = parameters, guide
        self.works: Mapping[type, guided.Work] = _WORKS
        self._tree, self._take = tree, take
        self._s, self._g = state.begin(parameters), Guided()
        q = parameters.settings
        self._look = Surveying(q.edges, q.pitch, dt)
        self.course = Course()
        self.lines: Callable[[], Lines] = lambda: QUIET
        self.leaning: Callable[[], float] = lambda: 0.0
        self._fastest = guide.velocity
        self.speed = guide.velocity  # of its moves at most, m/s

    def begin(self, sample: Sample, restored: Restored) -> None:
        """The stage stands where it was left, if that is known; an absolute sensor knows it."""
        self._g, self.course, self.speed = Guided(), Course(), self._fastest
        if self.searches:
            super().begin(sample, restored)
            return
        self._s = state.begin(self._p, sample.encoder, trusted=True)
        self._losable(False)

    @property
    def state(self) -> LiveState:
        """What it remembers."""
        return self._s

    @property
    def pitch(self) -> float:
        """Way per count, m."""
        return float(self._p.settings.pitch)

    @property
    def aim(self) -> float:
        """Where its set point is, m as the encoder has it; without one, where it stands."""
        return self._g.aim.position if self._g.on else self._s.seen.encoder * self.pitch

    @property
    def goal(self) -> float:
        """Where the motion under way goes, m as the encoder has it; NaN without one."""
        return math.nan if self._s.motion is None else self._s.motion.coarse * self.pitch

    @property
    def supersedes(self) -> bool:
        """May any new move replace one under way?"""
        return self._p.settings.supersede == 1

    @property
    def searches(self) -> bool:
        """Has it to home before its place is known?"""
        return self.guide.touch is not None

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]:
        """One control period."""
        guide = self.guide._replace(velocity=min(self.guide.velocity, self.speed))
        self._s, self._g, self.course, notices = guided.step(
            self._p,
            guide,
            self._s,
            self._g._replace(leaning=self.leaning()),
            sample,
            dt,
            self._look,
            self.works,
            self.lines(),
        )
        reference = self.course.aim.position / self._p.settings.pitch
        on = 1.0 if self.course.on else 0.0
        return Command(reference, on, 0.0, 0.0, 0.0), SAFE, notices

    def view(self) -> View:
        """The present state; a jog or a programme goes where its set point is now."""
        seen = super().view()
        if math.isnan(state.target(self._p, self._s)) and math.isfinite(seen.target):
            seen = seen._replace(target=self.aim - self._s.frame.offset * self.pitch)
        return seen

    def accept(self, request: Any) -> tuple[Reply, tuple[Notice, ...]]:
        """A request, between two periods."""
        refused = self._unable(request)
        if refused is not None:
            return refused, ()
        if isinstance(request, m.SetGains):
            return self._retune(request)
        if isinstance(request, m.SetSpeed):
            return self._pace(request)
        if isinstance(request, m.Programme):
            self._s, reply, notices = self._programme(request)
            return reply, tuple(notices)
        if not self.searches and isinstance(request, m.Home | m.ClearFault):
            return self._known(request)
        return super().accept(request)

    def refusal(self, request: Any) -> Refused | None:
        """Why it would be refused now."""
        refused = self._unable(request)
        if refused is not None:
            return refused
        if isinstance(request, m.SetGains):
            found = self._retuned(request)
            return found if isinstance(found, Refused) else None
        if isinstance(request, m.SetSpeed):
            return self._paceless(request)
        if isinstance(request, m.Programme):
            reply = self._programme(request)[1]
            return reply if isinstance(reply, Refused) else None
        return super().refusal(request)

    def _retune(self, request: m.SetGains) -> tuple[Reply, tuple[Notice, ...]]:
        """New gains for the law, which keeps its memory."""
        found = self._retuned(request)
        if isinstance(found, Refused):
            return found, ()
        self._tree, done = found
        self._take(trees.gains(self._tree))
        return Accepted(0, done), (gains.told(self._s, done),)

    def _retuned(self, request: m.SetGains) -> tuple[Any, tuple[m.Change, ...]] | Refused:
        """The settings with other gains, by the rules of a settings file; and what differs."""
        refused = gains.waits(self._p, self._s)
        found = refused or gains.taken(trees.gains(self._tree), request.changes)
        if isinstance(found, Refused):
            return found
        tree = self._tree._replace(**{trees.gains_set(self._tree): found[0]})
        return gains.unfit(tree) or (tree, found[1])

    def _pace(self, request: m.SetSpeed) -> tuple[Reply, tuple[Notice, ...]]:
        """Another speed for the moves to come."""
        refused = self._paceless(request)
        if refused is not None:
            return refused, ()
        self.speed = float(request.speed)
        facts = {f"speed_{self._p.settings.place.base}_per_s": self.speed, "client": request.client}
        return Accepted(), (transitions.reported(self._s, "speed", "set speed", facts),)

    def _paceless(self, request: m.SetSpeed) -> Refused | None:
        """Why moves cannot have this speed."""
        place = self._p.settings.place
        absent = alone.refusal(self._p.stages, request)
        if absent is not None:
            return absent
        if request.stage != m.MACRO:
            return Refused(f"{shown(request.stage)} is no stage", f'name "{m.MACRO}"')
        if self._s.motion is not None:
            return accept.BUSY
        unfit = targets.number(request.speed, "speed", place.named("m/s"))
        if unfit is not None or 0.0 < request.speed <= self._fastest * (1.0 + 1e-9):
            return unfit
        most = place.told(self._fastest, "m/s")
        return Refused(
            f"{place.told(request.speed, 'm/s')} is no speed of its moves", f"at most {most}"
        )

    def _programme(self, request: m.Programme) -> tuple[LiveState, Reply, tuple[Notice, ...]]:
        s, plan = self._s, request.plan
        refused = accept.unready(self._p, s, False)

        def start(s: LiveState, motion: Motion) -> tuple[LiveState, tuple[Notice, ...]]:
            return playing.start(s, motion, plan)

        found = refused or playing.motion(s, plan, self._p.settings.pitch, self._p.settings.place)
        return accept.begin(self._p, s, found, start)

    def _known(self, request: m.Home | m.ClearFault) -> tuple[Reply, tuple[Notice, ...]]:
        """An absolute sensor knows its place when its fault is cleared; a counter without a
        reference begins at 0 where the stage stands."""
        refused = self.refusal(request)
        if refused is not None:
            return refused, ()
        notices: tuple[Notice, ...] = ()
        if isinstance(request, m.ClearFault):
            reply, notices = super().accept(request)
            if not self._absolute or self._s.frame.trusted:
                return reply, notices
            offset, cause = self._s.frame.offset, "absolute sensor"
        else:
            offset, cause = self._s.seen.encoder, "zero where it stands"
        self._s, event = transitions.trusted(self._s, cause, offset)
        return Accepted(), (*notices, event)

    def fail(self, words: str, evidence: dict[str, Any], position_lost: bool) -> tuple[Notice, ...]:
        """Latch a fault."""
        self._losable(self.searches or position_lost)
        notices = super().fail(words, evidence, position_lost)
        self._losable(self.searches)
        return notices

    def lose(self, words: str) -> tuple[Notice, ...]:
        """The position is not known any more."""
        self._losable(True)
        notices = super().lose(words)
        self._losable(self.searches)
        return notices

    def _losable(self, lost: bool) -> None:
        """Set whether the position can be lost now: an interrupted motion does not cost a position
        that an absolute sensor knows; a fault of that sensor does."""
        self._s = self._s._replace(frame=self._s.frame._replace(carriage=lost))

    @property
    def _absolute(self) -> bool:
        """Does its sensor know the place by itself?"""
        homing = getattr(self._tree, "homing", None)
        return homing is None or homing.on != START

    def _unable(self, request: Any) -> Refused | None:
        if isinstance(request, m.Home) and not self.searches:
            return _ABSOLUTE if self._absolute or self._s.frame.trusted else None
        return None
