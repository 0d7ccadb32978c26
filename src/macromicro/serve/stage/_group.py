"""The live machine of several stages: a live machine of each stage, and their coordination."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from operator import itemgetter
from typing import Any, NamedTuple

from macromicro.control.live import alone
from macromicro.control.live import messages as m
from macromicro.control.live.accept import NOT_FOLLOWING
from macromicro.control.live.leading import Course
from macromicro.control.live.messages import Accepted, Event, Finished, Notice, Refused, Reply
from macromicro.control.live.plain import among, list_names, show
from macromicro.control.live.state import Braking, LiveState, Played
from macromicro.machines.sequence import Plan
from macromicro.place import Place
from macromicro.schema.par import finite
from macromicro.serve._machine import Point, StageView, View
from macromicro.serve.persist import Restored
from macromicro.serve.stage._machine import Led
from macromicro.serve.stage._playing import Together
from macromicro.types import SAFE, Command, Outputs, Sample

# The mode of all is the first of these that a stage is in; that of rest is the last motion's.
_FIRST = (m.FAULT, m.DISABLED, m.HOMING, m.MOVING_MACRO, m.SETTLING, m.STOPPED, m.READY)
_BUSY = Refused("a motion is under way", "wait for its end, or stop it")
_NO_PLAN = Refused("no programme of this machine is loaded", "load one first")
_MOTIONS = (*m.AXES_MOVES, m.Jog, m.Follow, m.Home, m.Programme)
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
Parts = list[tuple[int, Any]]  # request to each stage, by its index


class Motion(NamedTuple):
    """A motion of one or several stages."""

    number: int
    kind: str
    axes: tuple[int, ...]
    plans: Any = None
    ends: tuple[tuple[int, Finished], ...] = ()
    stopping: bool = False
    parts: Any = None  # of the motion that replaces this one
    later: tuple[tuple[int, Any], ...] = ()  # of stages that move in turn


class StageGroup:
    """A `serve.machine.Machine` of named stages, each a live single-stage machine.

    `samples` and `efforts` give the readings and the efforts of all stages.
    """

    def __init__(
        self,
        leds: Mapping[str, Led],
        together: Together,
        samples: Callable[[], Sequence[Sample]],
        efforts: Callable[[], Sequence[float]],
        *,
        in_turn: bool = False,
    ) -> None:
        self._names, self._leds = tuple(leds), tuple(leds.values())
        self._together, self._in_turn = together, in_turn
        self._samples, self._efforts = samples, efforts
        self._guides = [led.guide for led in self._leds]
        self._given, self._dt = 0, 0.0
        self._motion: Motion | None = None
        self._jogs = ""  # the axis of a jog
        self._well = True  # did the last motion end as done?
        self._mode = m.DISABLED
        self._why: tuple[str, dict[str, Any]] = ("", {})
        for k, led in enumerate(self._leds):
            own = {Played: partial(together.step, k), Braking: partial(together.brake, k)}
            led.works = {**led.works, **own}

    # As the loop asks for it

    def begin(self, sample: Sample, restored: Restored) -> None:
        offsets = iter((restored.offset, *restored.others))
        for led, seen in zip(self._leds, (sample, *self._samples()[1:]), strict=True):
            offset = next(offsets, math.nan) if led.searches else math.nan
            led.begin(seen, restored._replace(offset=offset))
        self._motion, self._given, self._mode = None, 0, m.DISABLED

    @property
    def searches(self) -> bool:
        """Whether a stage must home before its position is known."""
        return any(led.searches for led in self._leds)

    @property
    def courses(self) -> tuple[Course, ...]:
        return tuple(led.course for led in self._leds)

    def readings(self) -> tuple[float, ...]:
        """Counts of the stages whose position is known by homing, or of the first."""
        each = zip(self._leds, self._samples(), strict=True)
        homed = tuple(seen.encoder for led, seen in each if led.searches)
        return homed or (self._samples()[0].encoder,)

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]:
        self._dt = dt
        told: list[Notice] = []
        samples = (sample, *self._samples()[1:])
        self._together.places = tuple(
            (seen.encoder if math.isfinite(seen.encoder) else led.state.seen.encoder) * led.pitch
            for led, seen in zip(self._leds, samples, strict=True)
        )
        commands = []
        for k, led in enumerate(self._leds):
            command, _, notices = led.step(samples[k], dt)
            commands.append(command)
            told += self._heard(k, notices)
        told = _merge(told) + self._joined()
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
        absent = alone.refusal(self._names, request)
        if absent is not None:
            return absent
        parts = self._parts(request)
        if isinstance(parts, Refused):
            return parts
        waits = isinstance(request, (*_MOTIONS, m.SetSpeed))
        return (self._busy(request) if waits else None) or self._any(parts)

    def _parts(self, request: Any) -> Parts | Refused:
        """The request to each stage, or the reason why there is none."""
        own = _PARTS.get(type(request))
        if own is not None:
            return own(self, request)
        if not isinstance(request, m.Request):
            return Refused(f"{type(request).__name__} is not a request", "see the messages")
        return self._everyone(request)

    def _everyone(self, request: Any) -> Parts:
        return [(k, request) for k in range(len(self._leds))]

    def _ended(self, request: m.EndFollow) -> Parts | Refused:
        axes = () if self._motion is None else self._motion.axes
        return [(k, request) for k in axes] or NOT_FOLLOWING

    def fail(self, words: str, evidence: dict[str, Any], position_lost: bool) -> tuple[Notice, ...]:
        """Latch a fault of all stages."""
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
        """The state of the first stage, with mode and trust of all."""
        seen = self._seen = [led.view() for led in self._leds]
        trusted = math.prod(each.trusted for each in seen)
        number = 0 if self._motion is None else self._motion.number
        first = seen[0]._replace(target=self._target(0, seen[0]))
        return first._replace(mode=self._mode, motion=number, trusted=trusted)

    def views(self) -> list[StageView]:
        """Each stage at the last `view`."""
        each = enumerate(zip(self._leds, self._seen, self._efforts(), strict=True))
        return [
            StageView(
                led.state.seen.encoder,
                led.course.aim.position / led.pitch,
                effort,
                seen.position,
                seen.uncertainty,
                seen.offset,
                self._target(k, seen),
            )
            for k, (led, seen, effort) in each
        ]

    # What joins them

    def _followed(self, request: m.Follow) -> Parts | Refused:
        """The stages that follow, each by itself."""
        part = request._replace(stage=m.MACRO)
        if among(request.stage, (m.ALL,)):
            return self._everyone(part)
        parts = self._one(request.stage, lambda k: part)
        if isinstance(parts, Refused):
            return parts._replace(remedy=f'{parts.remedy}, or "{m.ALL}"')
        return parts

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

    def _to(self, k: int, position: Any) -> Any:
        return m.MoveTo(position, replace=True)

    def _by(self, k: int, distance: Any) -> Any:
        """A relative move of a stage as an absolute one."""
        if not finite(distance):
            return m.MoveBy(distance)  # its refusal says what is accepted
        target = self._target(k)
        here = self._leds[k].state.seen.position if math.isnan(target) else target
        return self._to(k, here + float(distance))

    def _target(self, k: int, seen: View | None = None) -> float:
        """Target of a stage: of the pending, present or last move, or NaN."""
        motion = self._motion
        waiting = () if motion is None else (*(motion.parts or ()), *motion.later)
        for stage, part in waiting:
            if stage == k and isinstance(part, m.MoveTo):
                return float(part.position)
        return (seen or self._leds[k].view()).target

    def _any(self, parts: Iterable[tuple[int, Any]]) -> Refused | None:
        """The first refusal of a stage."""
        for k, part in parts:
            refused = self._leds[k].refusal(part)
            if refused is not None:
                return refused._replace(reason=f"{self._names[k]}: {refused.reason}")
        return None

    def _searching(self) -> tuple[int, ...]:
        """Stages that home, or all."""
        found = tuple(k for k, led in enumerate(self._leds) if led.searches)
        return found or tuple(range(len(self._leds)))

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
            self._begin(Motion(self._given + 1, "programme", _axes(begin), plans), begin, told)
        elif isinstance(request, m.SetGains):
            return self._retune(parts, told)
        elif isinstance(request, m.Jog | m.EndFollow) and self._motion is not None:
            self._ask(parts, told)  # a jog goes on at another speed, or ends
        elif isinstance(request, m.Jog | m.Follow | m.Home):
            self._start(Motion(self._given + 1, _KINDS[type(request)], _axes(parts)), parts, told)
            self._jogs = request.stage if isinstance(request, m.Jog) else ""
        else:
            if isinstance(request, _ENDINGS) and self._motion is not None:
                self._motion = self._motion._replace(parts=None, later=())
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
                done += [c._replace(path=f"{self._names[k]}.{c.path}") for c in reply.changes]
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
        """Begin a move of one stage, or of several on a straight line from their set points."""
        moving = [self._leds[k] for k, _ in parts]
        here = [led.aim for led in moving]
        self._start(motion, parts, told)
        if len(parts) < 2:
            return
        if not self._in_turn:
            ends, speeds = [led.goal for led in moving], [led.speed for led in moving]
            guides = [self._guides[k] for k, _ in parts]
            line = self._together.straight(guides, here, ends, speeds)
            for led, guide in zip(moving, line, strict=True):
                led.guide = guide
        facts = {}
        for k, part in parts:
            place = self._place(k)
            facts[f"target_{self._names[k]}_{place.unit}"] = float(part.position) * place.per
        self._why = "programme" if motion.plans is not None else "point move", facts

    def _start(self, motion: Motion, parts: Parts, told: list[Notice]) -> None:
        """Ask the stages; where they move in turn, the next once the one before has arrived."""
        if self._in_turn:
            parts, later = parts[:1], tuple(parts[1:])
            motion = motion._replace(axes=_axes(parts), later=later)
        self._go(motion, parts, told)

    def _go(self, motion: Motion, parts: Parts, told: list[Notice]) -> None:
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
        """Turn modes and ends of a stage into those of all."""
        told: list[Notice] = []
        for notice in notices:
            if isinstance(notice, Finished):
                if self._motion is not None and k in self._motion.axes:
                    self._motion = self._motion._replace(ends=(*self._motion.ends, (k, notice)))
            elif notice.kind == "mode":
                self._why = notice.cause, self._of(k, notice.evidence)
            elif notice.kind == "trust":
                name, trusted = self._names[k], self._trusted()
                words = notice.cause if trusted else f"{name}: {notice.cause}"
                facts = {**notice.evidence, "trusted": trusted, "axis": name}
                told.append(notice._replace(cause=words, evidence=facts))
            else:
                dot = "." if notice.kind == "gains" else "_"
                told.append(notice._replace(evidence=self._of(k, notice.evidence, dot)))
        return told

    def _trusted(self) -> bool:
        return all(led.state.frame.trusted for led in self._leds)

    def _joined(self) -> list[Notice]:
        """Ends and mode of all after each stage's step."""
        told: list[Notice] = []
        self._end(told)
        mode = next(each for each in _FIRST if any(s.mode == each for s in self._states()))
        if mode == m.STOPPED and self._motion is None and self._well:
            mode = m.READY  # only another stage was stopped, before
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
        if motion.later and not failed:
            part, *later = motion.later
            axes = (*motion.axes, part[0])
            self._go(motion._replace(axes=axes, later=tuple(later)), [part], told)
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
            facts |= self._of(k, end.evidence)
        for k, (name, s) in enumerate(zip(self._names, self._states(), strict=True)):
            facts[f"{name}_{self._place(k).unit}"] = s.seen.position * self._place(k).per
        half = max(led.view().uncertainty for led in self._leds)
        outcome = failed[0].outcome if failed else m.DONE
        self._motion, self._jogs, self._well = None, "", not failed
        told.append(Finished(motion.number, outcome, math.nan, half, facts))

    def _play(self, motion: Motion, told: list[Notice]) -> None:
        """Begin the programme once all are at its start."""
        plans = motion.plans
        offsets = tuple(
            s.frame.offset * led.pitch for s, led in zip(self._states(), self._leds, strict=True)
        )
        self._together.start(plans, offsets)
        parts: Parts = [(k, m.Programme(plan)) for k, plan in enumerate(plans)]
        self._go(motion._replace(axes=_axes(parts), plans=None, ends=()), parts, told)

    def _states(self) -> list[LiveState]:
        return [led.state for led in self._leds]

    def _place(self, k: int) -> Place:
        return self._leds[k].place

    def _one(self, name: Any, part: Callable[[int], Any]) -> Parts | Refused:
        """The request to the stage of this name."""
        if not among(name, self._names):
            return Refused(f"{show(name)} is not an axis", f"name {list_names(self._names)}")
        k = self._names.index(name)
        return [(k, part(k))]

    def _each(self, values: Any, part: Callable[[int, Any], Any]) -> Parts | Refused:
        """The requests to the stages of a point."""
        if not isinstance(values, dict) or not values:
            return Refused(f"{show(values)} is not a point", f"name {list_names(self._names)}")
        parts: Parts = []
        for name, value in values.items():
            one = self._one(name, lambda k, value=value: part(k, value))  # type: ignore[misc]
            if isinstance(one, Refused):
                return one
            parts += one
        return sorted(parts, key=itemgetter(0))

    def _played(self, plans: Any) -> Parts | Refused:
        """A programme of each stage."""
        if not isinstance(plans, tuple) or len(plans) != len(self._leds):
            return _NO_PLAN
        if not all(isinstance(plan, Plan) for plan in plans):
            return _NO_PLAN
        return [(k, m.Programme(plan)) for k, plan in enumerate(plans)]

    def _changes(self, pairs: Any) -> Parts | Refused:
        """The changed gains of each stage."""
        found: dict[int, list[Any]] = {}
        for pair in pairs if isinstance(pairs, tuple) else (None,):
            path = pair[0] if isinstance(pair, tuple) and len(pair) == 2 else None
            name, _, rest = path.partition(".") if isinstance(path, str) else ("", "", "")
            if name not in self._names or not rest:
                such = f'a path such as "{self._names[0]}.position"'
                return Refused(f"{show(path)} is not a gain of this machine", such)
            found.setdefault(self._names.index(name), []).append((rest, *pair[1:]))
        return [(k, m.SetGains(tuple(own))) for k, own in found.items()]

    def _of(self, k: int, evidence: dict[str, Any], dot: str = "_") -> dict[str, Any]:
        """Evidence with the stage in front of each name."""
        name = self._names[k]
        return {n if n == "client" else f"{name}{dot}{n}": v for n, v in evidence.items()}

    def _now(self) -> float:
        return self._leds[0].state.time


# What each stage is asked for by requests that are not the same for all.
_PARTS: dict[type, Callable[[StageGroup, Any], Parts | Refused]] = {
    m.MovePoint: lambda group, request: group._each(request.to, group._to),
    m.MovePointBy: lambda group, request: group._each(request.by, group._by),
    m.MoveAxis: lambda group, r: group._one(r.axis, lambda k: group._to(k, r.position)),
    m.MoveAxisBy: lambda group, r: group._one(r.axis, lambda k: group._by(k, r.distance)),
    m.Follow: lambda group, request: group._followed(request),
    m.EndFollow: lambda group, request: group._ended(request),
    m.Jog: lambda group, r: group._one(r.stage, lambda k: r._replace(stage=m.MACRO)),
    m.SetSpeed: lambda group, r: group._one(r.stage, lambda k: r._replace(stage=m.MACRO)),
    m.Home: lambda group, request: [(k, request) for k in group._searching()],
    m.Programme: lambda group, request: group._played(request.plan),
    m.SetGains: lambda group, request: group._changes(request.changes),
}


def _axes(parts: Parts) -> tuple[int, ...]:
    return tuple(k for k, _ in parts)


def _merge(told: list[Notice]) -> list[Notice]:
    """Events that several stages report alike, once."""
    found: list[Notice] = []
    for notice in told:
        last = found[-1] if found else None
        if isinstance(notice, Event) and isinstance(last, Event) and notice[:5] == last[:5]:
            found[-1] = last._replace(evidence=last.evidence | notice.evidence)
        else:
            found.append(notice)
    return found
