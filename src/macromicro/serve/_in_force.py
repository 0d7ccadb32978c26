"""Gains and speed limits in force, followed through the loop's events."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Event
from macromicro.schema.par import entries, replaced

if TYPE_CHECKING:
    from macromicro.serve.choosing import AnySettings


class InForce:
    """The controller's settings, and the maximum speed of moves of each stage."""

    def __init__(self, settings: AnySettings) -> None:
        self._settings = settings
        self.control: Any = settings.controller
        self._speeds: dict[str, float] = settings.speeds

    def speed(self, stage: str) -> float:
        """Maximum speed of moves of a stage [m/s]; NaN if its law sets the speed."""
        return self._speeds.get(stage, math.nan)

    def follow(self, event: Event) -> None:
        """Take over what an event has changed."""
        if event.kind == "loop" and event.cause == "started":
            self.control, self._speeds = self._settings.controller, self._settings.speeds
        elif event.kind == "gains":
            known = {e.path for e in entries(self.control)}
            for path, change in event.evidence.items():
                if path in known:
                    self.control = replaced(self.control, path, change["new"])
        elif event.kind == "speed":
            self._speeds = {s: _speed(s, v, event.evidence) for s, v in self._speeds.items()}


def _speed(stage: str, before: float, evidence: dict[str, Any]) -> float:
    prefix = "" if stage == m.MACRO else f"{stage}_"
    for unit in ("m", "rad"):
        before = evidence.get(f"{prefix}speed_{unit}_per_s", before)
    return before
