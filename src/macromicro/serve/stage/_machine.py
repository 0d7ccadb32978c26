from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from macromicro.control.live import accept, alone, gains, guided, state, targets, transitions
from macromicro.control.live import messages as m
from macromicro.control.live.accept import Answer
from macromicro.control.live.leading import Course, Guide, Guided
from macromicro.control.live.messages import Accepted, Notice, Refused, Reply
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.plain import show
from macromicro.control.live.state import LiveState, Played
from macromicro.control.live.surveying import Surveying
from macromicro.machines import correcting
from macromicro.machines import tree as trees
from macromicro.machines.parts import START
from macromicro.place import Place
from macromicro.serve._machine import View
from macromicro.serve.live import Live
from macromicro.serve.persist import Restored
from macromicro.serve.stage import _playing
from macromicro.types import QUIET, SAFE, Command, Lines, Outputs, Sample

_WORKS = {**guided.WORKS, Played: _playing.step}
_ABSOLUTE = Refused(
    "this machine's place is known: by an absolute sensor, or from where it was switched on",
    "move it",
)


NO_MOTION = "it was pushed, showed no motion and was released"


class Led(Live):
    """A `serve.machine.Machine` that moves its stage by set points for the law."""

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
        self.degrees: Callable[[], float] = lambda: math.nan  # of the stage's sensor, degC
        self._beyond = False  # whether that is outside the temperatures of the calibration
        self._leant, self._stood = 0.0, math.nan  # for how long it was pushed and stood, and where
        self._fastest = guide.velocity
        self.speed = guide.velocity  # of its moves at most, m/s

    def begin(self, sample: Sample, restored: Restored) -> None:
        """Start at the saved position, or at that of an absolute sensor."""
        self._g, self.course, self.speed = Guided(), Course(), self._fastest
        if self.searches:
            super().begin(sample, restored)
            return
        self._s = state.begin(self._p, sample.encoder, trusted=True)
        self._losable(False)

    @property
    def courses(self) -> tuple[Course, ...]:  # type: ignore[override]
        return (self.course,)

    @property
    def state(self) -> LiveState:
        return self._s

    @property
    def pitch(self) -> float:
        """Travel per count."""
        return float(self._p.settings.pitch)

    @property
    def place(self) -> Place:
        """Its units."""
        return self._p.settings.place

    @property
    def aim(self) -> float:
        """Set point in the encoder's frame; without one the position."""
        return self._g.aim.position if self._g.on else self._s.seen.encoder * self.pitch

    @property
    def goal(self) -> float:
        """Target of the motion under way in the encoder's frame, or NaN."""
        return math.nan if self._s.motion is None else self._s.motion.coarse * self.pitch

    @property
    def supersedes(self) -> bool:
        """Whether a new move may replace one under way."""
        return self._p.settings.supersede == 1

    @property
    def searches(self) -> bool:
        """Whether it must home before its position is known."""
        return self.guide.touch is not None

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]:
        guide = self.guide._replace(velocity=min(self.guide.velocity, self.speed))
        leaning = self.leaning()
        lost = (*self._let_go(leaning, sample.encoder), *self._warmed())
        self._s, self._g, self.course, notices = guided.step(
            self._p,
            guide,
            self._s,
            self._g._replace(leaning=leaning),
            sample,
            dt,
            self._look,
            self.works,
            self.lines(),
        )
        reference = self.course.aim.position / self._p.settings.pitch
        on = 1.0 if self.course.on else 0.0
        return Command(reference, on, 0.0, 0.0, 0.0), SAFE, (*notices, *lost)

    def _let_go(self, leaning: float, encoder: float) -> tuple[Notice, ...]:
        """Note that a push ended before the guard could judge whether the stage moved."""
        pushed, self._leant = self._leant, leaning
        if leaning > 0.0:
            return ()
        stood, self._stood = self._stood, encoder
        touch = self.guide.touch
        long = touch is not None and pushed > touch.reveal
        still = abs(encoder - stood) * self.pitch <= self._tree.guard.still
        return self.lose(NO_MOTION) if long and still else ()

    def _warmed(self) -> tuple[Notice, ...]:
        """The event of a temperature that leaves those of the calibration, or comes back."""
        degrees = self.degrees()
        beyond = correcting.beyond(self._tree, degrees) > 0.0
        if beyond == self._beyond:
            return ()
        self._beyond = beyond
        cause = "outside the calibration's temperatures" if beyond else "back within them"
        return (transitions.report(self._s, "temperature", cause, {"degC": degrees}),)

    def view(self) -> View:
        """The present state; the target of a jog or programme is its set point."""
        seen = super().view()
        where = (seen.position, self._s.time)
        half = correcting.half_width(self._tree, self.degrees(), *where)
        if seen.trusted:
            seen = seen._replace(uncertainty=max(seen.uncertainty, half))
        if math.isnan(state.target(self._p, self._s)) and math.isfinite(seen.target):
            seen = seen._replace(target=self.aim - self._s.frame.offset * self.pitch)
        return seen

    def accept(self, request: Any) -> tuple[Reply, tuple[Notice, ...]]:
        if isinstance(request, m.SetGains):
            return self._retune(request)
        reply, notices = super().accept(request)
        if isinstance(request, m.SetSpeed) and isinstance(reply, Accepted):
            self.speed = float(request.speed)
        return reply, notices

    def refusal(self, request: Any) -> Refused | None:
        if isinstance(request, m.SetGains):
            found = self._retuned(request)
            return found if isinstance(found, Refused) else None
        return super().refusal(request)

    def _answered(self, request: Any) -> Answer:
        if isinstance(request, m.SetSpeed):
            return self._paced(request)
        if isinstance(request, m.Programme):
            return self._programme(request)
        if isinstance(request, m.Home) and not self.searches:
            return self._zeroed(request)
        if isinstance(request, m.ClearFault) and not self.searches:
            return self._cleared(request)
        return super()._answered(request)

    def _retune(self, request: m.SetGains) -> tuple[Reply, tuple[Notice, ...]]:
        """Change the law's gains; it keeps its memory."""
        found = self._retuned(request)
        if isinstance(found, Refused):
            return found, ()
        self._tree, done = found
        self._take(self._tree)
        return Accepted(0, done), (gains.gains_event(self._s, done),)

    def _retuned(self, request: m.SetGains) -> tuple[Any, tuple[m.Change, ...]] | Refused:
        """The settings with new gains, and the differences."""
        refused = gains.waits(self._p, self._s)
        found = refused or gains.take_changes(trees.live_gains(self._tree), request.changes)
        if isinstance(found, Refused):
            return found
        tree = trees.with_live_gains(self._tree, found[0])
        return gains.unfit(tree) or (tree, found[1])

    def _paced(self, request: m.SetSpeed) -> Answer:
        """Another speed of moves."""
        refused = self._paceless(request)
        if refused is not None:
            return self._s, refused, ()
        unit = f"speed_{self._p.settings.place.base}_per_s"
        facts = {unit: float(request.speed), "client": request.client}
        return self._s, Accepted(), (transitions.report(self._s, "speed", "set speed", facts),)

    def _paceless(self, request: m.SetSpeed) -> Refused | None:
        """Why moves cannot have this speed."""
        place = self._p.settings.place
        absent = alone.refusal(self._p.stages, request)
        if absent is not None:
            return absent
        if request.stage != m.MACRO:
            return Refused(f"{show(request.stage)} is not a stage", f'name "{m.MACRO}"')
        if self._s.motion is not None:
            return accept.BUSY
        unfit = targets.number(request.speed, "speed", place.named("m/s"))
        if unfit is not None or 0.0 < request.speed <= self._fastest * (1.0 + 1e-9):
            return unfit
        most = place.told(self._fastest, "m/s")
        return Refused(
            f"{place.told(request.speed, 'm/s')} is not a valid speed of its moves",
            f"at most {most}",
        )

    def _programme(self, request: m.Programme) -> Answer:
        s, plan, q = self._s, request.plan, self._p.settings
        refused = accept.unready(self._p, s, False)
        found = refused or _playing.motion(s, plan, q.pitch, q.place)
        return accept.begin(self._p, s, found, lambda s, motion: _playing.start(s, motion, plan))

    def _zeroed(self, request: m.Home) -> Answer:
        """The zero where the stage is, which cannot home."""
        s = self._s
        if self._absolute or s.frame.trusted:
            return s, _ABSOLUTE, ()
        reply = super()._answered(request)[1]
        if isinstance(reply, Refused):
            return s, reply, ()
        s, event = transitions.trust(s, "zero at its position", s.seen.encoder)
        return s, Accepted(), (event,)

    def _cleared(self, request: m.ClearFault) -> Answer:
        """After a fault only an absolute sensor knows the position."""
        s, reply, notices = super()._answered(request)
        if isinstance(reply, Refused) or not self._absolute or s.frame.trusted:
            return s, reply, notices
        s, event = transitions.trust(s, "absolute sensor", s.frame.offset)
        return s, Accepted(), (*notices, event)

    def fail(self, words: str, evidence: dict[str, Any], position_lost: bool) -> tuple[Notice, ...]:
        self._losable(self.searches or position_lost)
        notices = super().fail(words, evidence, position_lost)
        self._losable(self.searches)
        return notices

    def lose(self, words: str) -> tuple[Notice, ...]:
        self._losable(True)
        notices = super().lose(words)
        self._losable(self.searches)
        return notices

    def _losable(self, lost: bool) -> None:
        """Set whether an interruption costs the position, as it does without an absolute sensor."""
        self._s = self._s._replace(frame=self._s.frame._replace(carriage=lost))

    @property
    def _absolute(self) -> bool:
        """Whether its sensor is absolute."""
        homing = getattr(self._tree, "homing", None)
        return homing is None or homing.on != START
