"""Strokes that show mass and friction, and chirps that show a compliant drive."""

from __future__ import annotations

import math

import numpy as np

from macromicro.commission._probing import Direction, Ends, go
from macromicro.commission.stand import Caution, CommissionError, Record, Stand
from macromicro.models.mass import Axis

# The mass is unknown, but friction helps to brake: the distance of an acceleration suffices to stop
# under the same effort, so a stroke brakes half-way to the end of the window at the latest. Short
# records from rest have a known initial speed and accumulate little model error.

LEVELS = (0.05, 0.12, 0.25, 0.5, 0.8)  # parts of what is left of the effort above breakaway
STROKES = 8  # of each level
_LONGEST_STROKE = 1.5  # s
_HELD = (0.02, 0.15)  # s that one effort is held
_SOFTEST = 0.35  # least part of a level's effort
_LEAST = 20  # samples of a stroke that says something


class Stroke:
    """Random efforts one way, then the level's full effort the other way until it reverses."""

    def __init__(
        self, level: float, least: float, turn: float, speed: float, random: np.random.Generator
    ) -> None:
        self.level, self.least = level, min(1.15 * least, level)
        self.turn, self.speed, self.random = turn, speed, random
        self.way = 0.0
        self.until = -1.0
        self.effort = level
        self.braking = False

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None after the reversal."""
        if self.way == 0.0:
            self.way = 1.0 if self.turn > x else -1.0
            return 0.0  # shows what was given before the stroke, for a force that acts late
        if self.braking:
            return None if self.way * v <= 0.0 else -self.way * self.level
        if self.way * (x - self.turn) >= 0.0 or self.way * v > self.speed or t > _LONGEST_STROKE:
            self.braking = True
            return -self.way * self.level
        if t >= self.until:
            part = self.random.uniform(_SOFTEST, 1.0)
            self.effort = max(part * self.level, self.least)
            self.until = t + self.random.uniform(*_HELD)
        return self.way * self.effort


def excite(
    stand: Stand, found: Direction, ends: Ends, caution: Caution, creep: float
) -> list[Record]:
    least = found.surely(caution.effort)
    room = caution.effort - stand.pull.most - least
    if room < 0.1 * found.breakaway:
        most = stand.pull.most
        held = f", its load takes {most:.3g} V" if most else ""
        raise CommissionError(
            f"the axis starts at {found.breakaway:.3g} V{held} and the limit is "
            f"{caution.effort:.3g} V: nothing is left to accelerate it. Allow a larger "
            "--effort"
        )
    records: list[Record] = []
    window = caution._replace(low=ends.low, high=ends.high)
    slow = caution._replace(speed=creep)
    random = np.random.Generator(np.random.PCG64(1))
    middle = 0.5 * (ends.low + ends.high)
    for part in LEVELS:
        go(stand, middle, found, slow)
        level = least + part * room
        made = []
        for _ in range(STROKES):
            x = stand.position()
            end = ends.high if x < middle else ends.low
            turn = x + random.uniform(0.15, 0.48) * (end - x)
            law = Stroke(level, least, turn, 0.7 * caution.speed, random)
            record = stand.drive(law, 2.0 * _LONGEST_STROKE, window)
            stand.rest(caution)
            if not record.ended and len(record.t) >= _LEAST:
                made.append(record)
        records += made
        if len(made) < STROKES // 2 and part > LEVELS[0]:
            break
    if len(records) < STROKES:
        raise CommissionError(
            "almost no stroke stayed within the window and the speed limit. Allow a wider "
            "window, a higher --speed, or a shorter control period"
        )
    return records


# Sliding avoids sticking friction, so the chirp stays too weak to reverse the motion. Each pass is
# made with either sign; the difference cancels effects of position.

SECONDS = 1.5  # of a chirp
PASSES = 16  # half of them each way, half with either sign
LOW, HIGH = 5.0, 0.45  # Hz; and of the loop's frequency: where a chirp begins and ends
_RUN_UP = 0.5  # s in which the speed is reached, and held before the chirp begins
_WINDOW = 0.7  # of the way, that a pass takes at most
_SPEED = 0.4  # of the greatest speed, at most
_SLOW = 2.0 * math.pi * 1.5  # rad/s, bandwidth of the speed loop
_SWAY = 0.4  # of a pass' speed: the chirp's, from where it is made weaker
_CALMER, _AGAIN = 0.007, 0.12  # s in which it becomes weaker, and stronger
_STRONGER = 8.0  # times what the mass lets expect, at most


class Shake:
    """One pass: a run-up, then a chirp whose frequency rises in equal ratios."""

    def __init__(
        self,
        way: float,
        speed: float,
        sign: float,
        *,
        starts: float,
        about: Axis,
        most: float,
        dt: float,
        pitch: float,
    ) -> None:
        self.way, self.speed, self.sign, self.about = way, speed, sign, about
        self.most, self.dt = most, dt
        self.range = HIGH / dt / LOW
        self.swaying = max(_SWAY * speed, 1.5 * pitch / dt)
        self.gain = about.viscous + about.mass * _SLOW
        self.starts, self.held, self.mean, self.scale = starts, 0.0, 0.0, 0.5
        self.before = math.nan
        self.weaker, self.stronger = math.exp(-dt / _CALMER), math.exp(dt / _AGAIN)

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None at its end."""
        since, about = t - _RUN_UP, self.about
        if since >= SECONDS:
            return None
        step = 0.0 if math.isnan(self.before) else self.way * (x - self.before) / self.dt
        self.before = x
        self.mean += _SLOW * (step - self.mean) * self.dt
        slip = self.speed - self.way * v
        held = about.coulomb + about.viscous * self.speed
        if since < 0.0 and self.way * v < 0.3 * self.speed:
            held = max(held, 1.1 * self.starts)
        else:
            self.held += 0.25 * _SLOW * self.gain * slip * self.dt
        effort = self.way * (held + self.held + self.gain * slip)
        if since >= 0.0:
            much = abs(step - self.mean) > self.swaying
            self.scale = min(self.scale * (self.weaker if much else self.stronger), _STRONGER)
            effort += self.sign * self.chirp(since)
        return effort

    def chirp(self, t: float) -> float:
        rate = math.log(self.range) / SECONDS
        frequency = LOW * math.exp(rate * t)
        w = 2.0 * math.pi * frequency
        amplitude = min(self.scale * _SWAY * self.speed * self.about.mass * w, self.most)
        return amplitude * math.sin(2.0 * math.pi * (frequency - LOW) / rate)


def strength(found: Direction, effort: float) -> float:
    """Largest effort of the chirp: that of the weakest strokes, below any force limit."""
    least = found.surely(effort)
    return least + LEVELS[0] * max(effort - least, 0.0)


def speed(ends: Ends, caution: Caution) -> float:
    return min(_WINDOW * ends.travel / (SECONDS + _RUN_UP), _SPEED * caution.speed)


def shaken(
    stand: Stand, about: Axis, found: Direction, ends: Ends, caution: Caution, creep: float
) -> list[Record]:
    """All passes, the two of a pair in succession."""
    v, most = speed(ends, caution), strength(found, caution.effort)
    window = caution._replace(low=ends.low, high=ends.high)
    slow = caution._replace(speed=creep)
    middle = 0.5 * (ends.low + ends.high)
    kept: list[Record] = []
    for _ in range(PASSES // 4):
        made = []
        for sign, way in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
            go(stand, middle - way * 0.5 * _WINDOW * ends.travel, found, slow)
            law = Shake(
                way, v, sign, starts=found.surely(caution.effort), about=about, most=most,
                dt=stand.dt, pitch=stand.pitch,
            )  # fmt: skip
            made.append(stand.drive(law, 2.0 * SECONDS, window))
            stand.rest(caution)
        for pair in (made[::2], made[1::2]):
            if not any(one.ended for one in pair):
                first = round(_RUN_UP / stand.dt)
                kept += [Record(one.t[first:-1], one.u[first:-1], one.x[first:-1]) for one in pair]
    return kept
