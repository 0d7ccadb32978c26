"""Soft limits of a running machine, within its own."""

from __future__ import annotations

from typing import Any

from macromicro.control.live import transitions as t
from macromicro.control.live.messages import Accepted, Notice, Refused, Reply
from macromicro.control.live.parameters import LiveParameters, SoftLimits
from macromicro.control.live.plain import shown
from macromicro.control.live.state import LiveState, busy
from macromicro.place import Place
from macromicro.schema.par import finite


def _words(place: Place) -> dict[str, tuple[str, str, float]]:
    """Whose limits they are, their display unit and its scale."""
    return {
        "macro": ("the macro-stage", "counts", 1.0),
        "micro": ("the micro-stage", "mm", 1e3),
        "whole": ("the whole positioner", place.unit, place.per),
    }


def change(
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
    return s, Accepted(), (t.reported(s, "limits", "set limits", changed),)


def _problem(own: SoftLimits, new: Any, place: Place) -> Refused | None:
    if not isinstance(new, SoftLimits):
        return Refused(f"{shown(new)} are not soft limits", "give control.live's SoftLimits")
    for stage, (whose, unit, scale) in _words(place).items():
        low, high = getattr(new, f"{stage}_low"), getattr(new, f"{stage}_high")
        lowest, highest = getattr(own, f"{stage}_low"), getattr(own, f"{stage}_high")
        if not (finite(low) and finite(high)) or not lowest <= low < high <= highest:
            return Refused(
                f"soft limits of {_read(low, scale)} to {_read(high, scale)} {unit} for {whose}",
                f"give them from {lowest * scale:.9g} to {highest * scale:.9g} {unit}, the lower "
                "one first",
                True,
            )
    return None


def _read(value: Any, scale: float) -> str:
    return f"{value * scale:.9g}" if finite(value) else shown(value, 40)
