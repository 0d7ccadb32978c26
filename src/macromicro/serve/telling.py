"""Requests and events as clients have them: gains and lengths in the units that people read."""

from __future__ import annotations

from typing import Any

from macromicro.control.live.messages import Event, MoveMicro, MoveMicroBy, SetGains, SetLimits
from macromicro.control.live.parameters import SoftLimits
from macromicro.control.settings import Control
from macromicro.schema.par import Par, entries, finite
from macromicro.units import convert

_IN_MM = ("micro_low", "micro_high")


def _pars(control: Any) -> dict[str, Par]:
    return {e.path: e.par for e in entries(Control() if control is None else control)}


def millimetres(metres: Any) -> Any:
    """A length [m] in mm; what is not a finite number as it is."""
    return convert(metres, "m", "mm") if finite(metres) else metres


def limits(limits: SoftLimits) -> dict[str, Any]:
    """By name: counts of the macro-stage, mm of the micro-stage, m of the whole positioner."""
    found: dict[str, Any] = limits._asdict()
    return found | {name: millimetres(found[name]) for name in _IN_MM}


def soft_limits(values: dict[str, float]) -> SoftLimits:
    """All soft limits as `limits` gives them."""
    return SoftLimits(**values | {name: convert(values[name], "mm", "m") for name in _IN_MM})


def event(event: Event, control: Any = None) -> Event:
    """An event, its gains and limits in these units; lengths elsewhere name their unit.
    `control`: the gains of this machine; None: those of the two-stage one."""
    if event.kind == "gains":
        pars = _pars(control)
        facts = {
            path: {k: pars[path].given(v) for k, v in change.items()} if path in pars else change
            for path, change in event.evidence.items()
        }
    elif event.kind == "limits":
        facts = {
            name: {k: millimetres(v) for k, v in change.items()} if name in _IN_MM else change
            for name, change in event.evidence.items()
        }
    else:
        return event
    return event._replace(evidence=facts)


def request(request: Any, control: Any = None) -> dict[str, Any]:
    """The values of a request by name, without the client's; `control` as of `event`."""
    facts: dict[str, Any] = {k: v for k, v in request._asdict().items() if k != "client"}
    if isinstance(request, MoveMicro):
        facts["position"] = millimetres(request.position)
    elif isinstance(request, MoveMicroBy):
        facts["distance"] = millimetres(request.distance)
    elif isinstance(request, SetGains):
        pars = _pars(control)
        facts["changes"] = tuple(
            (p, pars[p].given(v) if p in pars else v) for p, v in request.changes
        )
    elif isinstance(request, SetLimits) and isinstance(request.limits, SoftLimits):
        facts["limits"] = SoftLimits(**limits(request.limits))
    return facts
