"""An axis that answers as `identify.axis` says, with stops and an encoder: quick, and known."""

from __future__ import annotations

import math
from typing import Any, Self

from macromicro.models.mass import Axis, acting
from macromicro.models.mass import glide as step
from macromicro.rig.session import Session
from macromicro.types import Outputs, Sample

PLAIN = Axis(mass=0.1, viscous=5.0, coulomb=1.0, stribeck=0.2, stribeck_speed=0.01)


class Virtual:
    """A rig of one axis.

    `sign` -1: leads exchanged; `deaf`: the encoder gives NaN from that time on, s; `late`: periods
    until an effort acts; `ripple`: of the friction along the way, V; `stiff`: of the stops, V/m.
    """

    channels = ("encoder",)

    def __init__(
        self,
        axis: Axis = PLAIN,
        *,
        dt: float = 1e-3,
        pitch: float = 1e-5,
        stops: tuple[float, float] = (-0.03, 0.07),
        sign: float = 1.0,
        deaf: float = math.inf,
        magnitude: bool = False,
        late: int = 0,
        ripple: float = 0.0,
        stiff: float = math.inf,
    ) -> None:
        self.axis, self.dt, self.pitch, self.stops = axis, dt, pitch, stops
        self.sign, self.deaf, self.magnitude = sign, deaf, magnitude
        self.x = self.v = self.t = 0.0
        self.offset = 1234.0
        self.effort = 0.0
        self.queue = [0.0] * late
        self.ripple, self.stiff = ripple, stiff
        self.most = 0.0
        self.reached = [0.0, 0.0]
        self.clock = self
        self.log: list[float] = []

    def now(self) -> float:
        return self.t

    def wait(self, dt: float) -> None:
        assert dt == self.dt
        self.queue.append(abs(self.effort) if self.magnitude else self.effort)
        pull = acting(self.axis, self.queue.pop(0), self.x, self.v, dt)
        low, high = self.stops
        if math.isfinite(self.stiff):  # stops that give, and are half damped
            beyond = self.x - min(max(self.x, low), high)
            damped = math.sqrt(self.stiff * self.axis.mass) * self.v if beyond else 0.0
            pull -= self.stiff * beyond + damped
            low, high = -math.inf, math.inf
        axis = self.axis
        if self.ripple:
            axis = axis._replace(coulomb=axis.coulomb + self.ripple * math.sin(self.x / 0.004))
        self.v, gone = step(axis, self.v, pull, dt)
        self.x += gone
        if not low <= self.x <= high:
            self.x, self.v = min(max(self.x, low), high), 0.0
        self.t += dt
        self.reached = [min(self.reached[0], self.x), max(self.reached[1], self.x)]

    def read(self) -> Sample:
        nan = math.nan
        count = self.offset + self.sign * math.floor(self.x / self.pitch)
        return Sample(self.t, nan if self.t >= self.deaf else count, nan, nan, nan, nan)

    def write(self, outputs: Outputs) -> None:
        self.effort = outputs.motor
        self.most = max(self.most, abs(outputs.motor))
        self.log.append(outputs.motor)

    def stop(self) -> None:
        self.effort = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        self.stop()


def session(rig: Virtual) -> Session:
    return Session(rig, rig.dt)
