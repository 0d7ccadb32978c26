"""A wire that is the law's own model, read by a sensor with a lag, a period late."""

from __future__ import annotations

import math

import numpy as np

from macromicro.control.inverse import law
from macromicro.control.inverse.model import Inverse, prepare
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled
from macromicro.models import stressed

DT = 1e-3
GAINS = Inverse()
# A law that takes its model for right.
SURE = GAINS._replace(doubt_base=0.0, doubt_heat=0.0, doubt_loss=0.0, doubt_lag=0.0)


class Wire:
    """Wire, sensor and law; places in mm."""

    def __init__(self, gains: Inverse = GAINS, plant: Inverse | None = None) -> None:
        self.p = prepare(gains)
        self.plant = prepare(plant or gains)
        self.s = stressed.cold(self.plant.model)
        self.memory = law.start(self.p, Sample(0.0, 0.0))
        self.volts, self.seen, self.beyond = 0.0, self.s.x, 0.0
        self.rate = 0.0  # mm/s by which the sensor's error grows
        self.warmer = 0.0  # K of heat that nobody told the law of
        self.places: list[float] = []
        self.sent: list[float] = []
        self.t = 0.0

    def _moved(self) -> None:
        s = self.s._replace(content=self.s.content + self.warmer * DT / self.plant.model.ladder.c1)
        new = compiled(stressed.step)(self.plant.model, s, self.volts, DT)
        mean = 0.5 * (self.s.x + new.x)
        lag = self.plant.sensor
        self.seen = mean + (self.seen - mean) * math.exp(-DT / lag) if lag > 0.0 else new.x
        self.s = new

    def period(
        self, goal: float, speed: float = 0.0, missing: bool = False, turn: float = math.inf
    ) -> float:
        """One period towards a goal."""
        reading = math.nan if missing else 1e-3 * (self.seen + self.beyond)
        aim = Target(1e-3 * goal, 1e-3 * speed, 0.0, turn)
        self.memory, volts = compiled(law.step)(
            self.p, self.memory, aim, Sample(self.t, reading), DT
        )
        self._after(volts)
        return volts

    def pause(self) -> None:
        """One period without a turn."""
        sample = Sample(self.t, 1e-3 * (self.seen + self.beyond))
        self.memory = compiled(law.rest)(self.p, self.memory, sample, DT)
        self._after(0.0)

    def _after(self, volts: float) -> None:
        self.places.append(self.s.x)
        self.sent.append(volts)
        self._moved()
        self.volts = volts  # acts from the next period on
        self.beyond += self.rate * DT
        self.t += DT

    def go(self, goal: float, seconds: float) -> np.ndarray:
        """Places of some time towards a goal."""
        for _ in range(round(seconds / DT)):
            self.period(goal)
        return np.array(self.places[-round(seconds / DT) :])
