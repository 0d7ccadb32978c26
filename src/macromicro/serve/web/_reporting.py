"""State, events and ends of motions as plain values for JSON."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.alone import possible
from macromicro.control.live.messages import Event, Finished
from macromicro.control.live.parameters import Live
from macromicro.control.settings import Control
from macromicro.schema.par import Par, entries
from macromicro.schema.text import plain
from macromicro.serve import telling
from macromicro.serve.requests import CONTROL, REQUESTS
from macromicro.serve.settings import AnySettings
from macromicro.serve.snapshot import Snapshot
from macromicro.units import size

SHORT = 1.0  # mm, or deg; a travel below that is shown in um, or mdeg, at first


def sensible_orders(
    now: Snapshot, supersede: bool, stages: tuple[str, ...] = m.STAGES
) -> list[str]:
    """Orders that make sense now, by their names on the page."""
    if not now.running or now.mode not in m.MODES:
        return []
    moving = now.motion != 0
    kinds = possible(
        m.MODES.index(now.mode),
        moving=moving,
        trusted=now.trusted,
        supersede=supersede,
        stages=stages,
    )
    return [kind.name for kind in REQUESTS if kind.access == CONTROL and kind.message in kinds]


def state(
    now: Snapshot,
    settings: Live,
    stages: tuple[str, ...] = m.STAGES,
    limited: tuple[str, ...] = telling.PARTS,
) -> dict[str, Any]:
    """The snapshot, the offered orders and the limited parts."""
    state: dict[str, Any] = {
        name: getattr(now, name)
        for name in ("time_s", "age_s", "running", "mode", "position_m", "uncertainty_m")
    }
    state |= {name: getattr(now, name) for name in ("trusted", "trust", "macro_count")}
    state["micro_mm"] = telling.millimetres(now.micro_m)
    state |= {name: getattr(now, name) for name in ("motor_v", "ctrl_v", "fan", "temperature_c")}
    state |= {name: getattr(now, name) for name in ("motion", "holder", "clients", "emergency_s")}
    state["limits"] = telling.limits(now.limits, limited)
    state["target_m"] = now.target_m
    state["possible"] = sensible_orders(now, settings.supersede == 1, stages)
    state["fault"] = None if now.fault is None else now.fault._asdict()
    state["axes"] = [axis._asdict() for axis in now.axes]
    state["lines"] = [list(each) for each in now.lines]
    state["pace"] = now.pace._asdict()
    state["recording"] = now.recording._asdict() | {"path": Path(now.recording.path).name}
    found: dict[str, Any] = plain(state)
    return found


def event(number: int, event: Event, control: Any) -> dict[str, Any]:
    """An event for the page's list."""
    found: dict[str, Any] = plain({"event": number, **telling.event(event, control)._asdict()})
    return found


def end_of_motion(number: int, end: Finished, time: float) -> dict[str, Any]:
    """The end of a motion."""
    at = time if math.isnan(end.time) else end.time
    state = {"event": number, "kind": "finished", **end._asdict(), "time": at}
    found: dict[str, Any] = plain(state)
    return found


def settings(control: Control) -> list[dict[str, Any]]:
    """The controller's settings: path, value, unit, meaning, bounds, choices."""
    return [
        {"path": e.path, "value": e.par.given(e.value), **_words(e.par, e.value)}
        for e in entries(control)
    ]


def _words(par: Par, value: Any) -> dict[str, Any]:
    kind = "choice" if isinstance(value, str) else "whole" if isinstance(value, int) else "number"
    return {
        "kind": kind,
        "unit": par.read_in,
        "meaning": par.meaning,
        "source": par.source,
        "low": plain(par.given(par.lo)),
        "high": plain(par.given(par.hi)),
        "positive": par.positive,
        "choices": list(par.choices),
    }


def axes(settings: AnySettings) -> list[dict[str, Any]]:
    """Name, travel [m] and jog speeds [m/s] of each axis."""
    return [
        {
            "name": name,
            "low": live.limits.whole_low,
            "high": live.limits.whole_high,
            "jog": live.jogging.macro,
            "jog_slow": live.jogging.slow,
        }
        for name, live in settings.axes
    ]


def limits(settings: AnySettings) -> dict[str, Any]:
    """What the page needs of the settings: soft limits, jog speeds, pitch and display units."""
    live, place = settings.live, settings.live.place
    travel = place.per * (live.limits.whole_high - live.limits.whole_low)
    return {
        **telling.limits(live.limits, settings.facts.limited),
        "pitch": live.pitch,
        "unit": place.fine if travel < SHORT else place.unit,
        "units": {place.unit: size(place.unit), place.fine: size(place.fine)},
        "base": place.base,
        "jog_macro": live.jogging.macro,
        "jog_slow": live.jogging.slow,
        "jog_micro": live.jogging.micro,
        "client_timeout": settings.serve.client_timeout,
        "lost_client": settings.serve.lost_client,
    }
