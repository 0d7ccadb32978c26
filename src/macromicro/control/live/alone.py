"""Machines with one stage: the rig's sensors decide, and requests to the other are refused."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused
from macromicro.control.live.plain import among
from macromicro.control.settings import Control
from macromicro.control.supervisor import Plan

SENSORS = {m.MACRO: "encoder", m.MICRO: "hall"}
_COUNT = "_count"  # behind the name of each of several stages: the channel of its encoder
# Of a machine with one place.
_ONE = (*m.ONE_MOVES, m.Zero, m.Fan, m.SetLimits)
_BY_STAGE = (m.Jog, m.SetSpeed, m.Follow)
_AXES_ONLY = Refused("this machine has no axes x and y", "use the stage that it has")
_NEEDS: dict[type, str] = {
    m.Home: m.MACRO,
    m.MoveMacro: m.MACRO,
    m.MoveMacroBy: m.MACRO,
    m.MoveMicro: m.MICRO,
    m.MoveMicroBy: m.MICRO,
}
# What of the controller's settings belongs to the micro-stage; all else is the macro-stage's.
_FINE = ("micro_law", "ctrl_limit", "p", "pi", "pi_antiwindup", "fine")
_ALL = Control._fields


def channel(stage: str) -> str:
    """The channel of the encoder of one of several stages."""
    return stage + _COUNT


def stages(channels: Iterable[str]) -> tuple[str, ...]:
    there = tuple(channels)
    alone = tuple(stage for stage, sensor in SENSORS.items() if sensor in there)
    return alone or tuple(c.removesuffix(_COUNT) for c in there if c.endswith(_COUNT))


def several(stages: tuple[str, ...]) -> bool:
    """Whether they are named stages that move together."""
    return not set(stages) <= set(m.STAGES)


def refusal(stages: tuple[str, ...], request: Any) -> Refused | None:
    """Why a machine of these stages cannot do this, whatever its mode."""
    named = request.stage if isinstance(request, _BY_STAGE) else ""
    if several(stages):
        if isinstance(request, _ONE) or among(named, m.STAGES):
            has = "two axes" if len(stages) == len(m.AXES) else f"{len(stages)} stages"
            return Refused(f"this machine has {has}", "name a point, or one of them")
        return None
    if isinstance(request, m.AXES_MOVES) or among(named, (*m.AXES, m.ALL)):
        return _AXES_ONLY
    for stage in m.STAGES:
        if stage not in stages and stage in _needed_stages(request):
            sensor = SENSORS[stage]
            return Refused(
                f"this machine has no {stage}-stage: its rig measures no {sensor}",
                "use the stage that it has",
            )
    return None


def _needed_stages(request: Any) -> frozenset[str]:
    kind = type(request)
    if kind in _NEEDS:
        return frozenset({_NEEDS[kind]})
    if isinstance(request, _BY_STAGE) and among(request.stage, m.STAGES):
        return frozenset({request.stage})
    if kind is m.Programme and isinstance(request.plan, Plan):
        return frozenset(s for k, s in enumerate(m.STAGES) if (request.plan.stage == k).any())
    if kind is m.SetGains and isinstance(request.changes, tuple):
        named = [pair[0] for pair in request.changes if isinstance(pair, tuple) and pair]
        sets = [path.partition(".")[0] for path in named if isinstance(path, str)]
        return frozenset(m.MICRO if s in _FINE else m.MACRO for s in sets if s in _ALL)
    return frozenset()


def nearest(position: float, pitch: float) -> float:
    return float(math.floor(position / pitch + 0.5))


_ALWAYS = frozenset({m.Stop, m.EmergencyStop, m.Disable, m.SetGains})
_MOTIONS = frozenset({*m.ONE_MOVES, m.Programme, m.Follow})


def possible(
    mode: int,
    *,
    moving: bool,
    trusted: bool,
    supersede: bool = False,
    stages: tuple[str, ...] = m.STAGES,
) -> frozenset[type]:
    """Which requests a mode allows, for user interfaces; `accept` decides."""
    if several(stages):
        one = possible(mode, moving=moving, trusted=trusted)
        replaces = supersede and trusted and mode in (m.MOVING_MACRO, m.SETTLING)
        return one.difference(_ONE) | set(m.AXES_MOVES if m.MoveTo in one or replaces else ())
    if mode == m.FAULT:
        return _ALWAYS | {m.ClearFault, m.SetLimits}
    found = set(_ALWAYS) | {m.Fan}
    if not moving:
        found |= {m.Zero, m.SetLimits}
    if mode == m.DISABLED:
        return frozenset(found | {m.Enable})
    replacing = supersede and mode in (m.MOVING_MACRO, m.SETTLING, m.MOVING_MICRO)
    if not moving or replacing:
        found |= {m.Jog}
        found |= _MOTIONS if trusted else set()
    if not moving:
        found |= {m.Home}
    elif mode in (m.MOVING_MACRO, m.MOVING_MICRO):
        found |= {m.EndFollow}
    if mode in (m.MOVING_MACRO, m.SETTLING) or m.MICRO not in stages:
        found -= {m.MoveMicro, m.MoveMicroBy}
    if m.MACRO not in stages:
        found -= {m.MoveMacro, m.MoveMacroBy, m.Home}
    return frozenset(found)
