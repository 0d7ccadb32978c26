"""The live machine of two axes: two single-stage machines and their coordination."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

from macromicro.control.live import alone
from macromicro.control.live import messages as m
from macromicro.control.live.accept import NOT_FOLLOWING
from macromicro.control.live.leading import Course
from macromicro.control.live.messages import (
    AXES,
    Accepted,
    Event,
    Finished,
    Notice,
    Refused,
    Reply,
)
from macromicro.control.live.plain import among, shown
from macromicro.control.live.state import Braking, LiveState, Played
from macromicro.machines.sequence import Plan
from macromicro.schema.par import finite
from macromicro.serve._machine import Point, Second, View
from macromicro.serve.joint._together import Together, straight
from macromicro.serve.persist import Restored
from macromicro.serve.stage._machine import Led
from macromicro.types import SAFE, Command, Outputs, Sample

# The mode of both is the first of these that an axis is in; that of rest is the last motion's.
_FIRST = (m.FAULT, m.DISABLED, m.HOMING, m.MOVING_MACRO, m.SETTLING, m.STOPPED, m.READY)
_BUSY = Refused("a motion is under way", "wait for its end, or stop it")
_NO_PLAN = Refused("no programme of two axes is loaded", "load one first")
_POINTS, _ALONE = (m.MovePoint, m.MovePointBy), (m.MoveAxis, m.MoveAxisBy)
_MOTIONS = (*_POINTS, *_ALONE, m.Jog, m.Follow, m.Home, m.Programme)
_KINDS: dict[type, str] = {
    m.MovePoint: "move to point",
    m.MovePointBy: "move point by",
    m.MoveAxis: "move axis",
    m.MoveAxisBy: "move axis by",
    m.Jog: "jog",
    m.Follow: "follow",
    m.Home: "home",
}
_ENDINGS = (m.Stop, m.EmergencyStop, m.Disable, m.LinkLost)
Parts = list[tuple[int, Any]]  # request to each axis, by its index


class Motion(NamedTuple):
    """A motion of one or both axes."""

    number: int
    kind: str
    axes: tuple[int, ...]
    plans: Any = None
    ends: tuple[tuple[int, Finished], ...] = ()
    stopping: bool = False
    parts: Any = None


class Pair:
    """A `serve.machine.Machine` of two axes, each a live single-stage machine."""

    def __init__(self, leds: tuple[Led, Led], tree: Any, together: Together) -> None:
        self._leds, self._tree, self._together = leds, tree, together
        self._guides = (leds[0].guide, leds[1].guide)
        self.other: Callable[[], Sample] = lambda: Sample(0.0, *[math.nan] * 5)
        self.effort: Callable[[], float] = lambda: 0.0
        self._given, self._dt = 0, 0.0
        self._motion: Motion | None = None
        self._jogs = ""  # the axis of a jog
        self._well = True  # did the last motion end as done?
        self._mode = m.DISABLED
        self._why: tuple[str, dict[str, Any]] = ("", {})
        for k, led in enumerate(leds):
            own = {Played: partial(together.step, k), Braking: partial(together.brake, k)}
            led.works = {**led.works, **own}

    # As the loop asks for it

    def begin(self, sample: Sample, restored: Restored) -> None:
        other = restored._replace(offset=restored.second_offset)
        for led, seen, known in zip(
            self._leds, (sample, self.other()), (restored, other), strict=True
        ):
            led.begin(seen, known)
        self._motion, self._given, self._mode = None, 0, m.DISABLED

    @property
    def searches(self) -> bool:
        """Whether an axis must home before its position is known."""
        return any(led.searches for led in self._leds)

    @property
    def courses(self) -> tuple[Course, Course]:
        return self._leds[0].course, self._leds[1].course

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]:
        self._dt = dt
        told: list[Notice] = []
        samples = (sample, self.other())
        self._together.places = tuple(  # type: ignore[assignment]
            (seen.encoder if math.isfinite(seen.encoder) else led.state.seen.encoder) * led.pitch
            for led, seen in zip(self._leds, samples, strict=True)
        )
        commands = []
        for k, led in enumerate(self._leds):
            command, _, notices = led.step(samples[k], dt)
            commands.append(command)
            told += self._heard(k, notices)
        told = _merged(told) + self._joined()
        return commands[0], SAFE, tuple(told)

    def accept(self, request: Any) -> tuple[Reply, tuple[Notice, ...]]:
        refused, parts = self.refusal(request), self._parts(request)
        if refused is not None or isinstance(parts, Refused):
            return refused or Refused("", ""), ()
        told: list[Notice] = []
        reply = self._do(request, parts, told)
        return reply, (*told, *self._joined())

    def heard(self, point: Point, age: float) -> tuple[Notice, ...]:
        axes = () if self._motion is None else self._motion.axes
        told: list[Notice] = []
        for k, own in zip(axes, point, strict=False):
            told += self._heard(k, self._leds[k].heard((own,), age))
        return tuple(told)

    def renew(self) -> None:
        for led in self._leds:
            led.renew()

    def refusal(self, request: Any) -> Refused | None:
        absent = alone.refusal(AXES, request)
        if absent is not None:
            return absent
        parts = self._parts(request)
        if isinstance(parts, Refused):
            return parts
        waits = isinstance(request, (*_MOTIONS, m.SetSpeed))
        return (self._busy(request) if waits else None) or self._any(parts)

    def _parts(self, request: Any) -> Parts | Refused:
        """The request to each axis, or the reason why there is none."""
        parts: Parts | Refused = [(0, request), (1, request)]
        if isinstance(request, m.MovePoint):
            parts = [(k, m.MoveTo(p, "", True)) for k, p in enumerate(request[:2])]
        elif isinstance(request, m.MovePointBy):
            parts = [(k, self._by(k, d)) for k, d in enumerate(request[:2])]
        elif isinstance(request, m.MoveAxis):
            parts = _of_axis(request.axis, m.MoveTo(request.position, "", True))
        elif isinstance(request, m.MoveAxisBy):
            parts = _of_axis(request.axis, None)
            if not isinstance(parts, Refused):
                parts = [(k, self._by(k, request.distance)) for k, _ in parts]
        elif isinstance(request, m.Follow):
            parts = _followed(request)
        elif isinstance(request, m.EndFollow):
            axes = () if self._motion is None else self._motion.axes
            parts = [(k, request) for k in axes] or NOT_FOLLOWING
        elif isinstance(request, m.Jog | m.SetSpeed):
            parts = _of_axis(request.stage, request._replace(stage=m.MACRO))
        elif isinstance(request, m.Home):
            parts = [(k, request) for k in self._searching()]
        elif isinstance(request, m.Programme):
            parts = _played(request.plan)
        elif isinstance(request, m.SetGains):
            parts = _changes(request.changes)
        elif not isinstance(request, m.Request):
            parts = Refused(f"{type(request).__name__} is not a request", "see the messages")
        return parts

    def fail(self, words: str, evidence: dict[str, Any], position_lost: bool) -> tuple[Notice, ...]:
        """Latch a fault of both axes."""
        return self._all(led.fail(words, evidence, position_lost) for led in self._leds)

    def lose(self, words: str) -> tuple[Notice, ...]:
        return self._all(led.lose(words) for led in self._leds)

    def doubt(self, words: str) -> tuple[Notice, ...]:
        """There is no Hall sensor."""
        return ()

    def found(self) -> tuple[float, float] | None:
        """There is no laser."""
        return None

    def view(self) -> View:
        """The state of the first axis, with mode and trust of both."""
        trusted = self._leds[0].view().trusted * self._leds[1].view().trusted
        number = 0 if self._motion is None else self._motion.number
        first = self._leds[0].view()._replace(target=self._target(0))
        return first._replace(mode=self._mode, motion=number, trusted=trusted)

    def second(self) -> Second:
        led, seen = self._leds[1], self._leds[1].view()
        return Second(
            led.state.seen.encoder,
            led.course.aim.position / led.pitch,
            self.effort(),
            seen.position,
            seen.uncertainty,
            seen.offset,
            self._target(1),
        )

    # What joins them

    def _busy(self, request: Any = None) -> Refused | None:
        """Whether another motion is under way; a jog may change its speed."""
        if self._motion is None:
            return None
        if isinstance(request, m.Jog) and request.stage == self._jogs:
            return None
        replaces = isinstance(request, m.AXES_MOVES) and (
            request.replace is True or self._leds[0].supersedes
        )
        return None if replaces and self._mode != m.HOMING else _BUSY

    def _by(self, k: int, distance: Any) -> Any:
        """A relative move of an axis as an absolute one."""
        if not finite(distance):
            return m.MoveBy(distance)  # its refusal says what is accepted
        target = self._target(k)
        here = self._leds[k].state.seen.position if math.isnan(target) else target
        return m.MoveTo(here + float(distance), "", True)

    def _target(self, k: int) -> float:
        """Target of an axis: of the pending, present or last move, or NaN."""
        waiting = () if self._motion is None else self._motion.parts or ()
        for axis, part in waiting:
            if axis == k and isinstance(part, m.MoveTo):
                return float(part.position)
        return self._leds[k].view().target

    def _any(self, parts: Iterable[tuple[int, Any]]) -> Refused | None:
        """The first refusal of an axis."""
        for k, part in parts:
            refused = self._leds[k].refusal(part)
            if refused is not None:
                return refused._replace(reason=f"{AXES[k]}: {refused.reason}")
        return None

    def _searching(self) -> tuple[int, ...]:
        """Axes that home, or all."""
        found = tuple(k for k, led in enumerate(self._leds) if led.searches)
        return found or (0, 1)

    def _do(self, request: Any, parts: Parts, told: list[Notice]) -> Reply:
        """Carry out an accepted request."""
        moves = isinstance(request, m.AXES_MOVES)
        if moves and self._motion is not None:
            kind = _KINDS[type(request)]
            self._supersede(self._motion, kind, parts, told)
        elif moves:
            kind = _KINDS[type(request)]
            self._begin(Motion(self._given + 1, kind, _axes(parts)), parts, told)
        elif isinstance(request, m.Programme):
            plans = tuple(part.plan for _, part in parts)
            begin = [(k, m.MoveTo(float(p.origin))) for k, p in enumerate(plans)]
            self._begin(Motion(self._given + 1, "programme", (0, 1), plans), begin, told)
        elif isinstance(request, m.SetGains):
            return self._retune(parts, told)
        elif isinstance(request, m.Jog | m.EndFollow) and self._motion is not None:
            self._ask(parts, told)  # a jog goes on at another speed, or ends
        elif isinstance(request, m.Jog | m.Follow | m.Home):
            self._start(Motion(self._given + 1, _KINDS[type(request)], _axes(parts)), parts, told)
            self._jogs = request.stage if isinstance(request, m.Jog) else ""
        else:
            if isinstance(request, _ENDINGS) and self._motion is not None:
                self._motion = self._motion._replace(parts=None)
            if isinstance(request, m.Stop) and self._playing():
                self._together.hold(self._dt)
            self._ask(parts, told)
            return Accepted()
        return Accepted(self._given)

    def _playing(self) -> bool:
        works = [s.work for s in self._states()]
        return all(isinstance(w, Played) and math.isfinite(w.start) for w in works)

    def _ask(self, parts: Parts, told: list[Notice]) -> None:
        """Pass on a request that cannot be refused."""
        for k, part in parts:
            told += self._heard(k, self._leds[k].accept(part)[1])

    def _retune(self, parts: Parts, told: list[Notice]) -> Reply:
        done: list[m.Change] = []
        for k, part in parts:
            reply, notices = self._leds[k].accept(part)
            told += self._heard(k, notices)
            if isinstance(reply, Accepted):
                done += [c._replace(path=f"{AXES[k]}.{c.path}") for c in reply.changes]
        return Accepted(0, tuple(done))

    def _supersede(self, old: Motion, kind: str, parts: Parts, told: list[Notice]) -> None:
        """Replace the motion under way, which first comes to rest on its path."""
        half = max(led.view().uncertainty for led in self._leds)
        facts = {"kind": old.kind, "by": kind}
        told.append(Finished(old.number, m.SUPERSEDED, math.nan, half, facts))
        axes = tuple(k for k, s in enumerate(self._states()) if s.motion is not None)
        self._given, self._jogs = self._given + 1, ""
        self._motion = Motion(self._given, kind, axes, stopping=True, parts=parts)
        if self._playing():
            self._together.hold(self._dt)
        self._ask([(k, m.Stop()) for k in axes], told)

    def _begin(self, motion: Motion, parts: Parts, told: list[Notice]) -> None:
        """Begin a move of one axis, or of both on a straight line from their set points."""
        here = [led.aim for led in self._leds]
        self._start(motion, parts, told)
        if len(parts) < len(AXES):
            return
        ends = [led.goal for led in self._leds]
        first, second = self._leds
        guides = straight(
            self._tree,
            self._guides,
            (here[0], here[1]),
            (ends[0], ends[1]),
            (first.speed, second.speed),
        )
        for led, guide in zip(self._leds, guides, strict=True):
            led.guide = guide
        facts = {f"target_{AXES[k]}_mm": float(part.position) * 1e3 for k, part in parts}
        self._why = "programme" if motion.plans is not None else "point move", facts

    def _start(self, motion: Motion, parts: Parts, told: list[Notice]) -> None:
        self._motion, self._given = motion, motion.number
        self._together.free()
        for k, _ in parts:
            self._leds[k].guide = self._guides[k]
        self._ask(parts, told)

    def _all(self, notices: Iterable[tuple[Notice, ...]]) -> tuple[Notice, ...]:
        told: list[Notice] = []
        for k, own in enumerate(notices):
            told += self._heard(k, own)
        return (*told, *self._joined())

    def _heard(self, k: int, notices: Iterable[Notice]) -> list[Notice]:
        """Turn modes and ends of an axis into those of both."""
        told: list[Notice] = []
        for notice in notices:
            if isinstance(notice, Finished):
                if self._motion is not None and k in self._motion.axes:
                    self._motion = self._motion._replace(ends=(*self._motion.ends, (k, notice)))
            elif notice.kind == "mode":
                self._why = notice.cause, _of(k, notice.evidence)
            elif notice.kind == "trust":
                words = notice.cause if self._trusted() else f"{AXES[k]}: {notice.cause}"
                facts = {**notice.evidence, "trusted": self._trusted(), "axis": AXES[k]}
                told.append(notice._replace(cause=words, evidence=facts))
            else:
                dot = "." if notice.kind == "gains" else "_"
                told.append(notice._replace(evidence=_of(k, notice.evidence, dot)))
        return told

    def _trusted(self) -> bool:
        return all(led.state.frame.trusted for led in self._leds)

    def _joined(self) -> list[Notice]:
        """Ends and mode of both after each axis' step."""
        told: list[Notice] = []
        self._end(told)
        mode = next(each for each in _FIRST if any(s.mode == each for s in self._states()))
        if mode == m.STOPPED and self._motion is None and self._well:
            mode = m.READY  # only the other axis was stopped, before
        if mode != self._mode:
            cause, evidence = self._why
            was, self._mode = m.MODES[self._mode], mode
            told.append(Event(self._now(), "mode", was, m.MODES[mode], cause, evidence))
        return told

    def _end(self, told: list[Notice]) -> None:
        motion = self._motion
        if motion is None or not motion.ends:
            return
        failed = [end for _, end in motion.ends if end.outcome != m.DONE]
        over = {k for k, _ in motion.ends}
        if over != set(motion.axes):
            if failed and not motion.stopping:
                self._motion = motion._replace(stopping=True)
                for k in set(motion.axes) - over:
                    told += self._heard(k, self._leds[k].accept(m.Stop())[1])
                self._end(told)
            return
        if motion.plans is not None and not failed:
            self._play(motion, told)
            return
        facts: dict[str, Any] = {}
        if motion.parts is not None and all(e.outcome == m.STOPPED_BY_REQUEST for e in failed):
            refused = self._any(motion.parts)
            if refused is None:
                after = Motion(motion.number, motion.kind, _axes(motion.parts))
                self._begin(after, motion.parts, told)
                return
            facts["refused"] = refused.reason
        for k, end in motion.ends:
            facts |= _of(k, end.evidence)
        facts |= {
            f"{n}_mm": s.seen.position * 1e3 for n, s in zip(AXES, self._states(), strict=True)
        }
        half = max(led.view().uncertainty for led in self._leds)
        outcome = failed[0].outcome if failed else m.DONE
        self._motion, self._jogs, self._well = None, "", not failed
        told.append(Finished(motion.number, outcome, math.nan, half, facts))

    def _play(self, motion: Motion, told: list[Notice]) -> None:
        """Begin the programme once both are at its start."""
        plans = motion.plans
        offsets = tuple(
            s.frame.offset * led.pitch for s, led in zip(self._states(), self._leds, strict=True)
        )
        self._together.start(plans, offsets)  # type: ignore[arg-type]
        parts: Parts = [(k, m.Programme(plan)) for k, plan in enumerate(plans)]
        self._start(motion._replace(plans=None, ends=()), parts, told)

    def _states(self) -> tuple[LiveState, LiveState]:
        return self._leds[0].state, self._leds[1].state

    def _now(self) -> float:
        return self._leds[0].state.time


def _axes(parts: Parts) -> tuple[int, ...]:
    return tuple(k for k, _ in parts)


def _of_axis(name: Any, part: Any) -> Parts | Refused:
    if not among(name, AXES):
        return Refused(f"{shown(name)} is not an axis", 'name "x" or "y"')
    return [(AXES.index(name), part)]


def _followed(request: m.Follow) -> Parts | Refused:
    """The axes that follow, each by itself."""
    part = request._replace(stage=m.MACRO)
    if among(request.stage, (m.ALL,)):
        return [(k, part) for k in range(len(AXES))]
    parts = _of_axis(request.stage, part)
    return parts._replace(remedy='name "x", "y" or "all"') if isinstance(parts, Refused) else parts


def _played(plans: Any) -> Parts | Refused:
    """A programme of each axis."""
    if not isinstance(plans, tuple) or len(plans) != len(AXES):
        return _NO_PLAN
    if not all(isinstance(plan, Plan) for plan in plans):
        return _NO_PLAN
    return [(k, m.Programme(plan)) for k, plan in enumerate(plans)]


def _changes(pairs: Any) -> Parts | Refused:
    """The changed gains of each axis."""
    found: dict[int, list[Any]] = {}
    for pair in pairs if isinstance(pairs, tuple) else (None,):
        path = pair[0] if isinstance(pair, tuple) and len(pair) == 2 else None
        axis, _, rest = path.partition(".") if isinstance(path, str) else ("", "", "")
        if axis not in AXES or not rest:
            return Refused(
                f"{shown(path)} is not a gain of this machine", 'a path such as "x.position"'
            )
        found.setdefault(AXES.index(axis), []).append((rest, *pair[1:]))
    return [(k, m.SetGains(tuple(own))) for k, own in found.items()]


def _merged(told: list[Notice]) -> list[Notice]:
    """Events that both axes report alike, once."""
    found: list[Notice] = []
    for notice in told:
        last = found[-1] if found else None
        if isinstance(notice, Event) and isinstance(last, Event) and notice[:5] == last[:5]:
            found[-1] = last._replace(evidence=last.evidence | notice.evidence)
        else:
            found.append(notice)
    return found


def _of(k: int, evidence: dict[str, Any], dot: str = "_") -> dict[str, Any]:
    """Evidence with the axis in front of each name."""
    return {n if n == "client" else f"{AXES[k]}{dot}{n}": v for n, v in evidence.items()}
