from __future__ import annotations

import math
from typing import Any

from macromicro.control import macro, outside
from macromicro.control.calibration import Calibration
from macromicro.control.live import accept, following, machine, state
from macromicro.control.live.accept import Answer
from macromicro.control.live.leading import Course
from macromicro.control.live.messages import STAGES, Notice, Refused, Reply, SetGains
from macromicro.control.live.parameters import LiveParameters, prepare
from macromicro.control.live.surveying import Surveying
from macromicro.nominal import PERIOD
from macromicro.serve._machine import Point, View
from macromicro.serve.persist import Restored
from macromicro.serve.settings import LiveSettings
from macromicro.types import Command, Outputs, Sample

_FIXED = Refused(
    "the board runs its own gains",
    "those of the settings are sent as it is opened: start again with others, or use --loop host",
)


class Live:
    """The two-stage `serve.machine.Machine`: parameters and state of `control.live`."""

    own_gains = False
    courses: tuple[Course, ...] = ()  # its laws give the outputs

    def __init__(self, parameters: LiveParameters) -> None:
        self._p = parameters
        self._s = state.begin(parameters)
        q = parameters.settings
        self._look = Surveying(q.edges, q.pitch, PERIOD)

    def begin(self, sample: Sample, restored: Restored) -> None:
        coordinate = sample.encoder - restored.offset  # NaN without a carriage
        known = coordinate if math.isfinite(coordinate) else None
        self._s = state.begin(self._p, known, trusted=restored.trusted)

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]:
        self._s, command, outputs, notices = machine.step(self._p, self._s, sample, dt, self._look)
        return command, outputs, notices

    def accept(self, request: Any) -> tuple[Reply, tuple[Notice, ...]]:
        self._s, reply, notices = self._answered(request)
        return reply, tuple(notices)

    def _answered(self, request: Any) -> Answer:
        if self.own_gains and isinstance(request, SetGains):
            return self._s, _FIXED, ()
        return accept.accept(self._p, self._s, request)

    def fail(self, words: str, evidence: dict[str, Any], position_lost: bool) -> tuple[Notice, ...]:
        self._s, notices = machine.fault(
            self._p, self._s, words, evidence, position_lost=position_lost
        )
        return notices

    def heard(self, point: Point, age: float) -> tuple[Notice, ...]:
        position, velocity = point[0]
        self._s, notices = following.take_set_point(self._p, self._s, position, velocity, age)
        return notices

    def renew(self) -> None:
        self._s = following.renew(self._s)

    def refusal(self, request: Any) -> Refused | None:
        _, reply, _ = self._answered(request)
        return reply if isinstance(reply, Refused) else None

    def lose(self, words: str) -> tuple[Notice, ...]:
        self._s, notices = machine.lose(self._s, words)
        return notices

    def doubt(self, words: str) -> tuple[Notice, ...]:
        if words == self._s.doubt:
            return ()
        self._s, notices = machine.doubt(self._p, self._s, words)
        return notices

    def found(self) -> tuple[float, float] | None:
        fault = self._s.fault
        if fault is None or fault.words != machine.DISAGREE:
            return None
        return fault.evidence["by_laser_counts"], fault.evidence["by_encoder_counts"]

    def own(self) -> list[float] | None:
        """The macro law's memory for the telemetry, or None."""
        kept = self._s.drive.memory[macro.SHIPPED :]
        return outside.values(kept) if kept else None

    def view(self) -> View:
        s = self._s
        half = state.uncertainty(self._p, s)
        return View(
            s.mode,
            s.motion.id if s.motion is not None else 0,
            macro.integral(s.drive.memory),
            s.drive.integral,
            s.seen.position,
            half,
            1.0 if math.isfinite(half) else 0.0,
            s.frame.offset,
            s.limits,
            state.goal(self._p, s),
        )


def make(settings: LiveSettings, table: Calibration, stages: tuple[str, ...] = STAGES) -> Live:
    return Live(prepare(settings.live, settings.controller, table, stages))
