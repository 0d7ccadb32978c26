"""What truth alone says of a machine: safe outputs, and a position that is where it says."""

from __future__ import annotations

import math
from collections import deque

from faultmatrix.bed import Period
from faultmatrix.bounds import Bounds

FALSE_S = 0.2  # s that a wrong position may be trusted
PUSH_S = 2.0  # s of more than the push limit without motion
_CALM_S = 0.05  # s of right positions behind which a wrong one is another one
_WINDOW = 10  # periods over which a speed is measured
_COAST_S = 0.02  # s
_FAST_S = 0.1  # s that a driven stage may be faster than half as much again as its moves


class Judge:
    """Sees every period since the fault."""

    def __init__(self, bounds: Bounds, onset: float) -> None:
        self.bounds, self.onset = bounds, onset
        self.unsafe: list[str] = []
        self.false = 0.0  # how far it was off, trusted, m
        self.fastest = 0.0  # m/s
        self.off = math.nan  # s since the onset, since when outputs are off
        self.effort = 0.0
        self.pushes = False  # more than the limit now
        self._places: deque[float] = deque(maxlen=_WINDOW + 1)
        self._times: deque[float] = deque(maxlen=_WINDOW + 1)
        self._driven = self._wrong = self._right = -math.inf
        self._pushed = [math.nan for _ in bounds.push]
        self._slow = onset
        self._stood = 0.0
        self._worst = 0.0

    def see(self, period: Period) -> None:
        """One period."""
        t = period.t
        self.effort = max(map(abs, period.outputs))
        if self.effort == 0.0:
            if math.isnan(self.off):
                self.off = t - self.onset
        else:
            self.off, self._driven = math.nan, t
        if math.isnan(period.true):
            return
        self._speed(period)
        self._push(period)
        self._trust(period)

    def _speed(self, period: Period) -> None:
        self._places.append(period.true)
        self._times.append(period.t)
        if len(self._places) <= _WINDOW or period.t - self._driven > _COAST_S:
            return
        span = self._times[-1] - self._times[0]
        way = abs(self._places[-1] - self._places[0]) - 2.0 * self.bounds.resolution
        speed = max(way, 0.0) / span
        self.fastest = max(self.fastest, speed)
        if speed <= 1.5 * self.bounds.fastest:
            self._slow = period.t
        elif period.t - self._slow > _FAST_S and not any("times" in u for u in self.unsafe):
            self.unsafe.append(f"{self.fastest / self.bounds.fastest:.2f} times its speed")

    def _push(self, period: Period) -> None:
        self.pushes = any(
            abs(output) > push
            for output, push in zip(period.outputs, self.bounds.push, strict=True)
        )
        moved = abs(period.true - self._stood) > self.bounds.still
        if moved:
            self._stood = period.true
        for k, (output, push) in enumerate(zip(period.outputs, self.bounds.push, strict=True)):
            if moved or abs(output) <= push or math.isnan(self._pushed[k]):
                self._pushed[k] = period.t
            elif period.t - self._pushed[k] > PUSH_S and not any("V for" in u for u in self.unsafe):
                self.unsafe.append(f"{abs(output):.1f} V for more than {PUSH_S:g} s, standing")

    def forget(self) -> None:
        """A wrong position that nothing could show: it counts from now on."""
        self.false, self._wrong, self._right = 0.0, -math.inf, -math.inf

    def _trust(self, period: Period) -> None:
        off = abs(period.told - period.true)
        if period.trusted and off > period.half + self.bounds.resolution:
            if period.t - self._right > _CALM_S and self._wrong == -math.inf:
                self._wrong, self._worst = period.t, 0.0
            self._worst = max(self._worst, off)
            self._right = period.t
            if period.t - self._wrong > FALSE_S:
                self.false = self._worst
        elif not period.trusted or period.t - self._right > _CALM_S:
            self._wrong = -math.inf
            self._right = -math.inf if not period.trusted else self._right
