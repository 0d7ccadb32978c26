"""A positioner of a few lines, whose every period is kept: for transcripts of the live machine.

The carriage has a dead zone and a lag, the wires a lag, the laser sees both. Nothing is random.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from macromicro.control.arrival import Sequence
from macromicro.control.live import messages, state
from macromicro.control.live.parameters import Edges
from macromicro.control.settings import Control
from macromicro.serve import telling
from macromicro.types import Outputs, Sample

from .bench import DT, PITCH, Machine
from .follower import QUICK, STOP, hall

NAN = math.nan
CONTROL = Control(sequence=Sequence(dwell=0.005, patience=0.4, wait=0.01))
LIVE = QUICK._replace(
    fine=QUICK.fine._replace(patience=0.6),
    homing=QUICK.homing._replace(speed=700.0, fastest=2000.0, patience=1.5),
    edges=Edges(needed=4, fastest=1500.0, noise=8e-6),
)


class Scripted(Machine):
    """The machine at a carriage that stands at `at` [counts, with the part of one]."""

    def __init__(self, at: float = 0.4, **rest: Any) -> None:
        super().__init__(**{"live": LIVE, "control": CONTROL, **rest})
        self.at, self.speed, self.fine, self.zero, self.k = at, 0.0, 0.0, 0.0, 0
        self.level = 0.0  # what the Hall sensor, which lags, shows of `fine` [m]
        self.lost, self.lead = 0.0, 0.0  # counts that the encoder misses; of the samples' time [s]
        self.beam, self.stuck = True, False
        self.rows: list[list[float]] = []
        self.names: list[str] = []

    def move(self) -> None:
        """A period of the outputs given last."""
        if self.out.laser_reset > 0.5:
            self.zero = self.at * PITCH + self.fine
        push = math.copysign(max(abs(self.out.motor) - 3.0, 0.0), self.out.motor)
        self.speed += (20000.0 * push - self.speed) * DT / 0.004
        if self.stuck or (self.speed < 0.0 and self.at <= STOP):
            self.speed = 0.0
        self.at = max(self.at + self.speed * DT, STOP)
        heat = max(self.out.ctrl - 1.3, 0.0) * 6e-3
        before = self.fine
        self.fine += (heat - self.fine) * DT / 0.01
        mean = 0.5 * (before + self.fine)
        self.level = mean + (self.level - mean) * math.exp(-DT / 3e-3)

    def tick(self, missing: str = "") -> Outputs:
        """Both stages move, then they are read; `missing`: e, h, l, t are no numbers."""
        self.move()
        self.k += 1
        noise = math.sin(1.7 * self.k)
        stage = self.at * PITCH + self.fine
        count = math.floor(self.at + 0.5) - math.floor(self.lost)
        sample = Sample(
            NAN if "t" in missing else self.s.time + self.s.shift + DT + self.lead,
            NAN if "e" in missing else float(count),
            NAN if "h" in missing else hall(self.level) + 1e-5 * noise,
            stage - self.zero + 2e-7 * noise if self.beam and "l" not in missing else NAN,
            1.0,
            0.0,
        )
        self.lead = 0.0
        out = self.show(sample)
        self.keep()
        return out

    def run(self, seconds: float, missing: str = "") -> None:
        for _ in range(round(seconds / DT)):
            self.tick(missing)

    def until(self, *modes: str, most: float = 1.5) -> None:
        """Until it is in one of these modes and no motion is under way, or just there."""
        for _ in range(round(most / DT)):
            if self.mode in modes:
                return
            self.tick()
        raise AssertionError(f"none of {modes} was reached, but {self.mode}")

    def end(self, most: float = 1.5) -> None:
        """Until the motion under way has ended."""
        for _ in range(round(most / DT)):
            if self.s.motion is None:
                return
            self.tick()
        raise AssertionError(f"no end within {most} s, mode {self.mode}")

    def keep(self) -> None:
        """What can be seen of the machine in this period."""
        s, p = self.s, self.p
        shown = {
            "mode": s.mode, "now": state.now(s), "time": s.time,
            **self.out._asdict(), **self.command._asdict(), **s.seen._asdict(),
            "coordinate": state.coordinate(s), "position_": state.position(p, s),
            "carriage": state.carriage(p, s), "uncertainty": state.uncertainty(p, s),
            "by_laser": state.by_laser(p, s), "busy": state.busy(s),
            "target": s.target.whole if s.motion is None else math.nan,
            "trusted": s.frame.trusted, "zero": s.frame.zero,
        }  # fmt: skip
        self.names = list(shown)
        self.rows.append([float(v) for v in shown.values()])

    def told(self) -> dict[str, Any]:
        """The transcript as clients read it: columns by name, contractions in mm, modes as they
        were gone through, all notices."""
        columns = np.array(self.rows).T
        for name in ("micro_reference", "micro_position", "fine"):
            columns[self.names.index(name)] *= 1e3
        modes = [int(m) for m in columns[0]]
        stays = [k for k in range(len(modes)) if k == 0 or modes[k] != modes[k - 1]]
        return {
            "modes": [[messages.MODES[modes[k]], k] for k in stays],
            "columns": dict(zip(self.names, columns, strict=True)),
            "events": [telling.event(e) for e in self.events],
            # Their time is the loop's, which sends them.
            "ends": [{k: v for k, v in end._asdict().items() if k != "time"} for end in self.ends],
        }
