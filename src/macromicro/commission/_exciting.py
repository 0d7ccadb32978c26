"""Strokes that show mass and friction: from rest, under random efforts, and braked to rest."""

# The mass is unknown, but friction helps to brake: the distance of an acceleration suffices to stop
# under the same effort, so a stroke brakes half-way to the end of the window at the latest. Short
# records from rest have a known initial speed and accumulate little model error.

from __future__ import annotations

import numpy as np

from macromicro.commission._probing import Direction, Ends, go
from macromicro.commission.stand import Caution, CommissionError, Record, Stand

LEVELS = (0.05, 0.12, 0.25, 0.5, 0.8)  # parts of what is left of the effort above breakaway
STROKES = 8  # of each level
_LONGEST_STROKE = 1.5  # s
_HELD = (0.02, 0.15)  # s that one effort is held
_SOFTEST = 0.35  # least part of a level's effort
_LEAST = 20  # samples of a stroke that says something


class Stroke:
    """Random efforts one way, then the level's full effort the other way until it reverses."""

    def __init__(
        self,
        level: float,
        least: float,
        turn: float,
        speed: float,
        random: np.random.Generator,
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
            "hardly a stroke stayed within the window and the speed limit. Allow a wider "
            "window, a higher --speed, or a shorter control period"
        )
    return records
