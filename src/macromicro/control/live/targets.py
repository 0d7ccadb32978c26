"""Turns requests into motions, or refuses them: targets, soft limits, trust."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from macromicro.control.live import alone
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.messages import Accepted, Notice, Refused, Reply
from macromicro.control.live.parameters import Live, LiveParameters, SoftLimits
from macromicro.control.live.plain import among, show
from macromicro.control.live.state import (
    NAN,
    LiveState,
    Motion,
    busy,
    by_laser,
    carriage,
    coordinate,
)
from macromicro.control.live.state import target as last_target
from macromicro.control.supervisor import Plan
from macromicro.place import LENGTH, Place
from macromicro.schema.par import finite

_LOAD = "load it with macromicro.programme"
HOME_FIRST = Refused(
    "the position is not known (not homed, or a move was interrupted)", "home first"
)


def number(value: Any, what: str, unit: str) -> Refused | None:
    """Refuse what is not a finite number."""
    if finite(value):
        return None
    return Refused(f"{what} {show(value)} is not a finite number", f"give it in {unit}", True)


def _beyond(
    value: float, low: float, high: float, what: str, unit: str, place: Place = LENGTH
) -> Refused | None:
    if low <= value <= high:
        return None
    if unit == "m":  # a person reads mm, or degrees
        value, low, high = (each * place.per for each in (value, low, high))
        unit = place.unit
    return Refused(
        f"{what} {value:.9g} {unit} is beyond the soft limits",
        f"give one from {low:.9g} to {high:.9g} {unit}",
        True,
    )


def _motion(s: LiveState, kind: str, target: float, count: float, fine: float) -> Motion:
    return Motion(s.given + 1, kind, target, count, fine, s.time)


def whole(
    p: LiveParameters, s: LiveState, target: Any, kind: str, carriage_rests: bool
) -> Motion | Refused:
    """A move of the whole positioner.

    The micro-stage alone if it reaches the target; otherwise the macro-stage moves to the highest
    count from which the rest is within the micro-stage's range.
    """
    q, fine, pitch = s.limits, p.settings.fine, p.settings.pitch
    place = p.settings.place
    refusal = number(target, "position", place.base) or _beyond(
        target, q.whole_low, q.whole_high, "position", "m", place
    )
    if refusal:
        return refusal
    target = float(target)
    if m.MICRO not in p.stages:  # to the nearest count
        found = coarse(s, alone.nearest(target, pitch))
        return found if isinstance(found, Refused) else found._replace(kind=kind, target=target)
    if m.MACRO not in p.stages:
        found = contraction(s, target)
        return found if isinstance(found, Refused) else found._replace(kind=kind, target=target)
    low = max(fine.bias_low, q.micro_low)
    high = min(fine.bias_high, q.micro_high)
    rest = target - carriage(p, s)
    if carriage_rests and low <= rest <= high:
        return _motion(s, kind, target, NAN, rest)
    # The laser shows where within its count the carriage stands.
    slack = s.laws.sequence.tolerance + (0.5 if by_laser(p, s) else 0.0)
    count = math.floor((target - low) / pitch - slack + 1e-9)
    count = min(count, math.floor(q.macro_high))
    rest = target - (count - slack) * pitch
    if count < q.macro_low or rest > high:
        return Refused(
            f"position {target * 1e3:.9g} mm is beyond the reach of both stages together",
            "stay within the soft limits of macro- and micro-stage",
            True,
        )
    return _motion(s, kind, target, count + s.frame.offset, NAN)


def reach(settings: Live, limits: SoftLimits, tolerance: float) -> tuple[float, float]:
    """Lowest and highest target that `whole` accepts (`tolerance` in counts)."""
    fine, pitch, slack = settings.fine, settings.pitch, tolerance + 0.5
    low = (math.ceil(limits.macro_low) + slack) * pitch
    high = (math.floor(limits.macro_high) - slack) * pitch
    low += max(fine.bias_low, limits.micro_low)
    high += min(fine.bias_high, limits.micro_high)
    # A nanometre less, so that no rounding matters.
    return max(limits.whole_low, round(low + 1e-9, 9)), min(
        limits.whole_high, round(high - 1e-9, 9)
    )


def coarse(s: LiveState, counts: Any) -> Motion | Refused:
    q = s.limits
    refusal = number(counts, "macro position", "counts") or _beyond(
        counts, q.macro_low, q.macro_high, "macro position", "counts"
    )
    if refusal:
        return refusal
    if counts != math.floor(counts):
        return Refused(
            f"{counts!r} counts is not a whole number", "give a whole number of counts", True
        )
    return _motion(s, "move macro", NAN, float(counts) + s.frame.offset, NAN)


def origin(p: LiveParameters, s: LiveState) -> float:
    known = last_target(p, s)
    return s.seen.position if math.isnan(known) else known


def coarse_origin(p: LiveParameters, s: LiveState) -> float:
    """Where a relative move of the macro-stage starts."""
    here, target = coordinate(s), s.target.macro
    free = m.MICRO in p.stages and s.mode not in (m.MOVING_MACRO, m.SETTLING)
    if math.isnan(target) or (free and abs(target - here) > s.laws.sequence.tolerance):
        return here
    return target


def contraction(s: LiveState, position: Any) -> Motion | Refused:
    q = s.limits
    refusal = number(position, "micro position", "m") or _beyond(
        position, q.micro_low, q.micro_high, "micro position", "m"
    )
    return refusal or _motion(s, "move micro", NAN, NAN, float(position))


def follow(s: LiveState, stage: Any, hold: Any) -> Motion | Refused:
    """A motion that follows streamed set points."""
    if not among(stage, m.STAGES):
        return Refused(f"{show(stage)} is not a stage", 'name "macro" or "micro"')
    refusal = _check_hold(hold, m.SHORTEST_HOLD, m.LONGEST_HOLD)
    return refusal or _motion(s, f"follow {stage}", NAN, NAN, NAN)


def _check_hold(hold: Any, least: float, most: float) -> Refused | None:
    """Refuse what is no hold time."""
    if finite(hold) and least <= hold <= most:
        return None
    return Refused(f"{show(hold)} s is not a hold time", f"from {least:g} to {most:g} s", True)


def jog(p: LiveParameters, s: LiveState, stage: Any, speed: Any, hold: Any) -> Motion | Refused:
    """A jog; an untrusted carriage may only creep."""
    q, limits = p.settings.jogging, s.limits
    if not among(stage, m.STAGES):
        return Refused(f"{show(stage)} is not a stage", 'name "macro" or "micro"')
    most = q.micro if stage == m.MICRO else q.macro if s.frame.trusted else q.slow
    refusal = number(speed, "speed", p.settings.place.named("m/s"))
    refusal = refusal or _check_hold(hold, 0.0, m.JOG_HOLD)
    if refusal:
        return refusal
    if abs(speed) > most:
        hint = "" if stage == m.MICRO or s.frame.trusted else " (not homed)"
        return Refused(f"speed {speed:.9g} m/s is too fast{hint}", f"at most {most:g} m/s", True)
    place, low, high = coordinate(s), limits.macro_low, limits.macro_high
    if stage == m.MICRO:
        place, low, high = s.seen.fine, limits.micro_low, limits.micro_high
    known = s.frame.trusted or stage == m.MICRO
    if known and ((speed > 0.0 and place >= high) or (speed < 0.0 and place <= low)):
        return Refused(f"the {stage}-stage is at its soft limit", "jog the other way")
    return _motion(s, f"jog {stage}", NAN, NAN, NAN)


def _column(values: Any) -> bool:
    """Whether this is one float per move."""
    if type(values) is not np.ndarray:
        return False
    return values.ndim == 1 and values.dtype.kind in "iuf" and np.can_cast(values.dtype, float)


def _unset(time: Any) -> bool:
    return isinstance(time, float) and math.isnan(time)


def plan(s: LiveState, plan: Any) -> Motion | Refused:
    """A programme with every target within the soft limits."""
    refusal = _misshapen(plan) or _senseless(plan)
    if refusal:
        return refusal
    q = s.limits
    bounds = ((q.macro_low, q.macro_high, "counts"), (q.micro_low, q.micro_high, "m"))
    for k, (low, high, unit) in enumerate(bounds):
        for value in plan.target[plan.stage == k]:
            refusal = _beyond(float(value), low, high, "a target of", unit)
            if refusal:
                return refusal
    return _motion(s, "programme", NAN, NAN, NAN)


def _misshapen(plan: Any) -> Refused | None:
    if not isinstance(plan, Plan) or not all(_column(a) for a in (*plan[:4], *plan[5:])):
        return Refused("no programme is loaded", _LOAD)
    if plan.stage.dtype.kind not in "iu" or not plan.stage.size:
        return Refused("no programme is loaded", _LOAD)
    rates = [a for a in plan[5:] if a.size]
    if any(a.shape != plan.stage.shape for a in (*plan[:4], *rates)) or len(rates) == 1:
        return Refused("the programme's columns differ in length", "give one value per move")
    return None


def _senseless(plan: Plan) -> Refused | None:
    clocked = plan.start == -math.inf  # set points of a profile, behind another one of its stage
    own = np.append(False, plan.stage[1:] == plan.stage[:-1])
    if np.isinf(plan.start[~(clocked & own)]).any() or not (finite(plan.end) or _unset(plan.end)):
        return Refused("the programme has invalid times", "give seconds, or NaN for no time")
    if not np.isin(plan.stage, (0, 1)).all() or not np.isfinite(plan.target).all():
        return Refused("the programme has moves without stage or target", "correct these moves")
    if not (np.isfinite(plan.hold).all() and (plan.hold >= 0.0).all()):
        return Refused("the programme has invalid hold times", "give seconds, 0 or more")
    return None


def _words(place: Place) -> dict[str, tuple[str, str, float]]:
    """Whose limits they are, their display unit and its scale."""
    return {
        "macro": ("the macro-stage", "counts", 1.0),
        "micro": ("the micro-stage", "mm", 1e3),
        "whole": ("the whole positioner", place.unit, place.per),
    }


def change_limits(
    p: LiveParameters, s: LiveState, limits: Any
) -> tuple[LiveState, Reply, tuple[Notice, ...]]:
    """Set new soft limits; a stage outside may still move inwards."""
    if busy(s):
        return s, Refused("a motion is under way", "wait for its end, or stop it"), ()
    own = p.settings.limits
    new = own if limits is None else limits
    problem = _problem(own, new, p.settings.place)
    if problem is not None:
        return s, problem, ()
    names = [name for name in own._fields if getattr(new, name) != getattr(s.limits, name)]
    changed = {n: {"old": getattr(s.limits, n), "new": getattr(new, n)} for n in names}
    s = s._replace(limits=new)
    return s, Accepted(), (t.report(s, "limits", "set limits", changed),)


def _problem(own: SoftLimits, new: Any, place: Place) -> Refused | None:
    if not isinstance(new, SoftLimits):
        return Refused(f"{show(new)} are not soft limits", "give control.live's SoftLimits")
    for stage, (whose, unit, scale) in _words(place).items():
        low, high = getattr(new, f"{stage}_low"), getattr(new, f"{stage}_high")
        lowest, highest = getattr(own, f"{stage}_low"), getattr(own, f"{stage}_high")
        if not (finite(low) and finite(high)) or not lowest <= low < high <= highest:
            return Refused(
                f"soft limits of {_text(low, scale)} to {_text(high, scale)} {unit} for {whose}",
                f"give them from {lowest * scale:.9g} to {highest * scale:.9g} {unit}, the lower "
                "one first",
                True,
            )
    return None


def _text(value: Any, scale: float) -> str:
    return f"{value * scale:.9g}" if finite(value) else show(value, 40)
