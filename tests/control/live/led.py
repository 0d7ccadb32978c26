"""A stage that follows its set point at once, under the live machine, for tests."""

from __future__ import annotations

import math
from typing import Any

from macromicro.control.live import accept, guided, state
from macromicro.control.live import messages as m
from macromicro.control.live.leading import Course, Guide, Guided, Ready, Touch, at
from macromicro.control.live.messages import Accepted, Finished
from macromicro.control.live.parameters import Brake, Edges, Jogging, Live, SoftLimits, prepare
from macromicro.types import Sample

DT, PITCH = 1e-3, 1e-5
TOUCH = Touch(0.05, 0.01, 1.5, 1e-3, 0.1, 1e-4, 2e-3, -0.0105, 20.0)
ABSOLUTE = Guide(0.2, 2.0, 100.0, Ready(3e-5, 0.01, 0.5), -0.008, 0.108)
LIMITS = SoftLimits(macro_low=-500.0, macro_high=10000.0, whole_low=-0.005, whole_high=0.1)
JOGS = Jogging(macro=0.1, slow=0.05, patience=0.2)
SETTINGS = Live()._replace(
    pitch=PITCH, limits=LIMITS, jogging=JOGS, brake=Brake(2.0, 1e6), edges=Edges(use=0, bounce=0.0)
)


class Stage:
    """Follows its set point at once, up to a wall; stands while it is stuck or off."""

    def __init__(self, touch: Touch | None = None, place: float = 0.0, raw: float = 0.0) -> None:
        self.p = prepare(SETTINGS, stages=(m.MACRO,))
        self.q = ABSOLUTE._replace(touch=touch)
        self.s, self.g = state.begin(self.p), Guided()
        if touch is None:
            self.s = state.begin(self.p, round((place - raw) / PITCH), trusted=True)
        self.place, self.raw, self.wall, self.stuck = place, raw, -math.inf, False
        self.told = math.nan  # place that its sensor shows for good; NaN: its own
        self.dither = 0  # counts that it shows more every other period
        self.course, self.tick = Course(), 0
        self.notices: list[Any] = []
        self.fastest = 0.0
        self.run(1)

    def run(self, periods: int) -> None:
        for _ in range(periods):
            told = self.place if math.isnan(self.told) else self.told
            counts = float(math.floor((told - self.raw) / PITCH + 0.5))
            counts += self.dither * (self.tick % 2)
            sample = Sample(self.tick * DT, counts, *[math.nan] * 4)
            self.s, self.g, self.course, notices = guided.step(
                self.p, self.q, self.s, self.g, sample, DT
            )
            self.notices += notices
            if self.course.on and not self.stuck:
                self.place = max(at(self.course.aim, DT).position + self.raw, self.wall)
                self.fastest = max(self.fastest, abs(self.course.aim.velocity))
            self.tick += 1
            assert self.tick < 60_000, self.s

    def ask(self, request: Any) -> m.Reply:
        self.s, reply, notices = accept.accept(self.p, self.s, request)
        self.notices += notices
        return reply

    def end(self, request: Any, periods: int = 20000) -> Finished:
        reply = self.ask(request)
        assert isinstance(reply, Accepted), reply
        for _ in range(periods):
            self.run(1)
            ends = [n for n in self.notices if isinstance(n, Finished) and n.id == reply.id]
            if ends:
                return ends[0]
        raise AssertionError(self.s)


def enabled(**given: Any) -> Stage:
    stage = Stage(**given)
    assert stage.ask(m.Enable()) == Accepted(0)
    stage.run(2)
    return stage
