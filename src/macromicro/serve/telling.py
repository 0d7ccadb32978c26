"""Requests, events and calibrations as clients see them, in display units."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from macromicro.control.live.alone import nearest
from macromicro.control.live.messages import Event, MoveMicro, MoveMicroBy, SetGains, SetLimits
from macromicro.control.live.parameters import SoftLimits
from macromicro.control.settings import Control
from macromicro.machines.tree import is_corrected
from macromicro.schema.par import Par, entries, finite
from macromicro.units import convert

if TYPE_CHECKING:
    from macromicro.serve.settings import AnySettings

PARTS = ("macro", "micro", "whole")  # what has soft limits of its own
_IN_MM = ("micro_low", "micro_high")


def _pars(control: Any) -> dict[str, Par]:
    return {e.path: e.par for e in entries(Control() if control is None else control)}


def millimetres(metres: Any) -> Any:
    """A finite length [m] in mm."""
    return convert(metres, "m", "mm") if finite(metres) else metres


def limit_names(parts: Iterable[str]) -> tuple[str, ...]:
    """Names of the soft limits of "macro", "micro" and "whole"."""
    return tuple(f"{part}_{end}" for part in parts for end in ("low", "high"))


def limits(limits: SoftLimits, parts: Iterable[str] = PARTS) -> dict[str, Any]:
    """Soft limits by name: counts (macro), mm (micro), m (whole)."""
    found = {name: getattr(limits, name) for name in limit_names(parts)}
    return found | {name: millimetres(found[name]) for name in _IN_MM if name in found}


def soft_limits(values: dict[str, float], before: SoftLimits, pitch: float) -> SoftLimits:
    """The soft limits `before`, updated by `limits`."""
    found = values | {name: convert(values[name], "mm", "m") for name in _IN_MM if name in values}
    if "macro_low" not in values:
        found |= {f"macro_{e}": nearest(values[f"whole_{e}"], pitch) for e in ("low", "high")}
    return before._replace(**found)


def event(event: Event, control: Any = None) -> Event:
    """An event with gains and limits in display units."""
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
    """The values of a request by name, without the client's."""
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


def calibrations(settings: AnySettings) -> list[dict[str, Any]]:
    """Of each calibrated stage its name, when it was measured, and the temperatures [degC]."""
    corrections = ((name, own.correction) for name, own in settings.trees if is_corrected(own))
    return [
        {"stage": name, "made": p.made, "temperature": p.temperature, "cold": p.cold, "hot": p.hot}
        for name, p in corrections
    ]
