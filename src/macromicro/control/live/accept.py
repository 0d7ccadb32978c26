"""Accepts or refuses requests at once, with reason and remedy; `step` carries them out."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from macromicro.control.live import (
    _homing,
    _moves,
    _programme,
    _steering,
    alone,
    brake,
    gains,
    targets,
)
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.messages import Accepted, Notice, Refused, Reply
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.plain import among, show
from macromicro.control.live.state import Followed, Jogged, LiveState, Motion, carriage

Answer = tuple[LiveState, Reply, tuple[Notice, ...]]

_RUNNING = (m.MOVING_MACRO, m.SETTLING, m.MOVING_MICRO)
_OK = Accepted(0)


def accept(p: LiveParameters, s: LiveState, request: Any) -> Answer:
    handle = _HANDLERS.get(type(request))
    if handle is None:
        return s, Refused(f"{type(request).__name__} is not a request", "see the messages"), ()
    absent = alone.refusal(p.stages, request)
    if absent:
        return s, absent, ()
    return handle(p, s, request)


def _enable(p: LiveParameters, s: LiveState, request: m.Enable) -> Answer:
    if s.mode == m.FAULT:
        return s, _FAULT, ()
    if s.mode != m.DISABLED:
        return s, Refused("the positioner is enabled", "use it as it is, or disable it first"), ()
    if math.isnan(s.seen.position):
        return s, _NO_SAMPLE, ()
    s, event = t.go(s, m.READY, t.ENABLE, {"client": request.client})
    return s, _OK, (event,)


def _emergency(p: LiveParameters, s: LiveState, request: m.EmergencyStop) -> Answer:
    s = s._replace(fan=0.0, drive=t.idle(s.drive)._replace(reset=False))
    lost: tuple[Notice, ...] = ()
    if s.motion is not None:
        s, lost = t.distrust(s, t.EMERGENCY + " on the way")
    s, reply, notices = _switch_off(p, s, m.EMERGENCY, t.EMERGENCY, request.client)
    return s, reply, (*lost, *notices)


def _switch_off(p: LiveParameters, s: LiveState, outcome: str, cause: str, client: str) -> Answer:
    if s.mode in (m.DISABLED, m.FAULT):
        return s, _OK, ()
    s, notices = t.conclude(p, s, m.DISABLED, (outcome, cause), {"client": client})
    return s, _OK, notices


def _stop(p: LiveParameters, s: LiveState, request: m.Stop) -> Answer:
    if s.mode == m.MOVING_MICRO:
        s, notices = _moves.stay(p, s, m.STOPPED_BY_REQUEST, t.STOP)
        return s, _OK, notices
    if s.mode in m.MOVING:
        s, notices = brake.start(p, s, m.STOPPED_BY_REQUEST, t.STOP)
        return s, _OK, notices
    return s, _OK, ()  # at rest, or coming to rest


def _link_lost(p: LiveParameters, s: LiveState, request: m.LinkLost) -> Answer:
    if not among(request.action, ("stop", "hold")):
        return s, Refused(f"{show(request.action)} is not an action", '"stop" or "hold"'), ()
    notices: tuple[Notice, ...] = ()
    if s.mode in (m.MOVING_MICRO, m.HOLDING) and request.action == "stop":
        s, notices = t.conclude(p, s, m.STOPPED, (m.LOST, t.LINK_LOST), {})
    elif s.mode == m.MOVING_MICRO:
        s, notices = _moves.stay(p, s, m.LOST, t.LINK_LOST)
    elif s.mode in m.MOVING:
        s, notices = brake.start(p, s, m.LOST, t.LINK_LOST)
    return s, _OK, notices


def _zero(p: LiveParameters, s: LiveState, request: m.Zero) -> Answer:
    if s.mode == m.FAULT:
        return s, _FAULT, ()
    if math.isnan(s.seen.position):
        return s, _NO_SAMPLE, ()
    if s.motion is not None:
        return s, BUSY, ()
    here = s.seen.position
    frame, drive = s.frame._replace(zero=here), s.drive._replace(reset=True)
    s = s._replace(frame=frame, drive=drive)
    found = {f"zero_{p.settings.place.base}": here, "client": request.client}
    return s, _OK, (t.report(s, "zero", "zero", found),)


def _fan(p: LiveParameters, s: LiveState, request: m.Fan) -> Answer:
    if s.mode == m.FAULT:
        return s, _FAULT, ()
    on: Any = request.on
    if on is not True and on is not False:
        return s, Refused(f"{show(request.on)} is neither on nor off", "True or False"), ()
    s = s._replace(fan=1.0 if request.on else 0.0)
    return s, _OK, (t.report(s, "fan", "fan", {"on": request.on, "client": request.client}),)


def _clear(p: LiveParameters, s: LiveState, request: m.ClearFault) -> Answer:
    if s.fault is None:
        return s, Refused("there is no fault", "nothing to clear"), ()
    if request.gone is not True:
        return s, Refused(f"the cause persists: {s.fault.words}", "remove it, then clear"), ()
    evidence = {"words": s.fault.words, "client": request.client}
    s, event = t.go(s._replace(fault=None), m.DISABLED, t.FAULT_CLEARED, evidence)
    return s, _OK, (event,)


def _obstacle(
    p: LiveParameters, s: LiveState, jogging: str = "", replace: Any = False
) -> Refused | None:
    """Why no motion can begin now."""
    if s.mode == m.FAULT:
        return _FAULT
    if s.mode == m.DISABLED:
        return Refused("the positioner is disabled", "enable it first")
    if s.motion is None or (isinstance(s.work, Jogged) and s.motion.kind == jogging):
        return None
    if s.mode == m.STOPPED:
        return Refused("the carriage is still coming to rest", "wait until it has")
    may = replace is True or p.settings.supersede == 1
    return None if may and s.mode != m.HOMING else BUSY


def unready(p: LiveParameters, s: LiveState, replace: Any) -> Refused | None:
    return _obstacle(p, s, replace=replace) or (None if s.frame.trusted else targets.HOME_FIRST)


def begin(
    p: LiveParameters,
    s: LiveState,
    motion: Motion | Refused,
    start: Callable[[LiveState, Motion], tuple[LiveState, tuple[Notice, ...]]],
) -> Answer:
    """Begin a motion, in place of one under way if there is one."""
    if isinstance(motion, Refused):
        return s, motion, ()
    s, ends = t.finish(p, s, m.SUPERSEDED, {"by": motion.kind})
    s, notices = start(s._replace(given=motion.id), motion)
    return s, Accepted(motion.id), (*ends, *notices)


def _home(p: LiveParameters, s: LiveState, request: m.Home) -> Answer:
    motion: Motion | Refused = Motion(s.given + 1, "home", math.nan, math.nan, math.nan, s.time)
    if s.mode in _RUNNING:
        motion = BUSY  # homing never replaces a motion
    return begin(p, s, _obstacle(p, s) or motion, partial(_homing.start, p))


def _rests(s: LiveState) -> bool:
    return s.mode not in (m.MOVING_MACRO, m.SETTLING)


def _whole(p: LiveParameters, s: LiveState, position: Any, kind: str, replace: Any) -> Answer:
    refusal = unready(p, s, replace)
    motion = refusal or targets.whole(p, s, position, kind, _rests(s))

    def start(s: LiveState, motion: Motion) -> tuple[LiveState, tuple[Notice, ...]]:
        facts = {f"target_{p.settings.place.base}": motion.target}
        if math.isnan(motion.coarse):
            return _moves.start_micro(
                s, motion, t.MICRO_MOVE, {**facts, "micro_mm": motion.fine * 1e3}
            )
        facts["target_counts"] = motion.coarse - s.frame.offset
        return _moves.start_macro(s, motion, t.MACRO_MOVE, facts)

    return begin(p, s, motion, start)


def _move_by(p: LiveParameters, s: LiveState, request: m.MoveBy) -> Answer:
    refusal = targets.number(request.distance, "distance", p.settings.place.base)
    if refusal:
        return s, _obstacle(p, s, replace=request.replace) or refusal, ()
    goal = targets.origin(p, s) + float(request.distance)
    return _whole(p, s, goal, "move by", request.replace)


def _move_macro_by(p: LiveParameters, s: LiveState, request: m.MoveMacroBy) -> Answer:
    refusal = unready(p, s, request.replace) or targets.number(request.counts, "distance", "counts")
    if refusal:
        return s, refusal, ()
    goal = targets.coarse_origin(p, s) + float(request.counts)
    s, reply, notices = _coarse(p, s, math.floor(goal + 0.5), request.replace)
    if isinstance(reply, Accepted):  # what was rounded off is not lost to the next one
        s = s._replace(target=s.target._replace(macro=goal))
    return s, reply, notices


def _coarse(p: LiveParameters, s: LiveState, counts: Any, replace: Any) -> Answer:
    refusal = unready(p, s, replace)

    def start(s: LiveState, motion: Motion) -> tuple[LiveState, tuple[Notice, ...]]:
        facts = {"target_counts": motion.coarse - s.frame.offset}
        return _moves.start_macro(s, motion, t.MACRO_MOVE, facts)

    return begin(p, s, refusal or targets.coarse(s, counts), start)


def _move_micro_by(p: LiveParameters, s: LiveState, request: m.MoveMicroBy) -> Answer:
    refusal = targets.number(request.distance, "distance", "m")
    if refusal:
        return s, _obstacle(p, s, replace=request.replace) or refusal, ()
    here = s.seen.fine if math.isnan(s.target.micro) else s.target.micro
    return _contraction(p, s, here + float(request.distance), request.replace)


def _contraction(p: LiveParameters, s: LiveState, position: Any, replace: Any) -> Answer:
    refusal = unready(p, s, replace)
    if refusal is None and not _rests(s):
        refusal = _MOVING

    def start(s: LiveState, motion: Motion) -> tuple[LiveState, tuple[Notice, ...]]:
        facts = {"micro_mm": motion.fine * 1e3, "target_m": carriage(p, s) + motion.fine}
        return _moves.start_micro(s, motion, t.MICRO_MOVE, facts)

    return begin(p, s, refusal or targets.contraction(s, position), start)


def _begin_jog(p: LiveParameters, s: LiveState, request: m.Jog) -> Answer:
    stage = request.stage if among(request.stage, m.STAGES) else ""
    refusal = _obstacle(p, s, f"jog {stage}")
    motion = refusal or targets.jog(p, s, request.stage, request.speed, request.hold)
    if isinstance(motion, Refused):
        return s, motion, ()
    under_way = s.motion if isinstance(s.work, Jogged) else None
    if under_way is not None and under_way.kind == motion.kind:
        return _other_speed(p, s, under_way, request)
    if request.speed == 0.0:
        return s, Refused(f"no jog of the {request.stage}-stage is under way", "give a speed"), ()
    if request.stage == m.MICRO and not _rests(s):
        return s, _MOVING, ()
    return begin(p, s, motion, lambda s, motion: _steering.start_jog(p, s, motion, request))


def _other_speed(p: LiveParameters, s: LiveState, motion: Motion, request: m.Jog) -> Answer:
    fine = among(request.stage, (m.MICRO,))
    if request.speed == 0.0:
        end = _moves.stay if fine else brake.start
        s, notices = end(p, s, m.STOPPED_BY_REQUEST, t.JOG_ENDED)
        return s, Accepted(motion.id), notices
    if isinstance(s.work, Jogged):
        goal = request.speed if fine else request.speed / p.settings.pitch
        s = s._replace(work=s.work._replace(goal=goal, hold=request.hold, renewed=s.time))
    return s, Accepted(motion.id), ()


def _follow(p: LiveParameters, s: LiveState, request: m.Follow) -> Answer:
    refusal = unready(p, s, False)
    if refusal is None and among(request.stage, (m.MICRO,)) and not _rests(s):
        refusal = _MOVING
    motion = refusal or targets.follow(s, request.stage, request.hold)
    return begin(p, s, motion, lambda s, motion: _steering.start_follow(s, motion, request))


def _end_follow(p: LiveParameters, s: LiveState, request: m.EndFollow) -> Answer:
    if not isinstance(s.work, Followed) or s.motion is None:
        return s, NOT_FOLLOWING, ()
    return s._replace(work=s.work._replace(ending=True)), Accepted(s.motion.id), ()


def _run(p: LiveParameters, s: LiveState, request: m.Programme) -> Answer:
    motion = unready(p, s, False) or targets.plan(s, request.plan)
    return begin(p, s, motion, lambda s, motion: _programme.start(s, motion, request.plan))


_FAULT = Refused("a fault is latched", "remove its cause and clear it first")
_MOVING = Refused("the carriage is moving", "stop it first")
BUSY = Refused("a motion is under way", "wait for its end, or stop it")
NOT_FOLLOWING = Refused("no set points are followed", "begin with follow")
_NO_SPEED = Refused("the law sets the speed of this machine's moves", "change its settings")
_NO_SAMPLE = Refused("the sensors have not answered yet", "try again")

_HANDLERS: dict[type, Callable[[LiveParameters, LiveState, Any], Answer]] = {
    m.Enable: _enable,
    m.Disable: lambda p, s, r: _switch_off(p, s, m.STOPPED_BY_REQUEST, t.DISABLE, r.client),
    m.Home: _home,
    m.MoveTo: lambda p, s, r: _whole(p, s, r.position, "move to", r.replace),
    m.MoveBy: _move_by,
    m.MoveMacro: lambda p, s, r: _coarse(p, s, r.counts, r.replace),
    m.MoveMicro: lambda p, s, r: _contraction(p, s, r.position, r.replace),
    m.MoveMacroBy: _move_macro_by,
    m.MoveMicroBy: _move_micro_by,
    m.Jog: _begin_jog,
    m.Follow: _follow,
    m.EndFollow: _end_follow,
    m.Stop: _stop,
    m.EmergencyStop: _emergency,
    m.Zero: _zero,
    m.Fan: _fan,
    m.Programme: _run,
    m.SetGains: lambda p, s, request: gains.change(p, s, request.changes),
    m.SetSpeed: lambda p, s, request: (s, _NO_SPEED, ()),
    m.SetLimits: lambda p, s, request: targets.change_limits(p, s, request.limits),
    m.ClearFault: _clear,
    m.LinkLost: _link_lost,
}
