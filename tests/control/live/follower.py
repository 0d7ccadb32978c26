"""A positioner without physics: each stage goes where it is told, quickly; for many sequences."""

from __future__ import annotations

import numpy as np

from macromicro.control import calibration
from macromicro.control.arrival import Sequence
from macromicro.control.live.messages import Enable
from macromicro.control.live.parameters import Brake, Fine, Homing, Jogging, Live
from macromicro.control.settings import Control
from macromicro.types import Outputs, Sample

from .bench import DT, Machine

STOP = -142.0
QUICK = Live(
    fine=Fine(window=0.004, dwell=0.008, patience=0.1),
    homing=Homing(speed=1000.0, fastest=20000.0, stand=0.01, patience=0.8),
    jogging=Jogging(patience=0.05),
    brake=Brake(rest=0.005, patience=0.05),
)
QUICK_CONTROL = Control(sequence=Sequence(dwell=0.005, patience=0.2, wait=0.01))
_TABLE = calibration.default_calibration()
_VOLTS = _TABLE.low + _TABLE.step * np.arange(len(_TABLE.position))


def hall(contraction: float) -> float:
    """Reading [V] at a contraction [m]."""
    return float(np.interp(contraction, _TABLE.position, _VOLTS))


class Follower(Machine):
    """The machine with a carriage that follows its reference while the motor is on."""

    def __init__(self, encoder: float = 0.0, **rest: object) -> None:
        super().__init__(**{"live": QUICK, "control": QUICK_CONTROL, **rest})  # type: ignore[arg-type]
        self.encoder, self.fine, self.odd = encoder, 0.0, False

    def tick(self, *, missing: str = "", noise: float = 0.0) -> Outputs:
        """One period: both stages move, then they are read."""
        if self.out.motor != 0.0:
            gap = self.command.macro_reference - self.encoder
            self.encoder = max(self.encoder + np.sign(gap) * min(abs(gap), 10.0), STOP)
        wanted = self.command.micro_reference if self.command.micro_active else 0.0
        self.fine += 0.5 * (wanted - self.fine)
        encoder = np.nan if "e" in missing else float(np.floor(self.encoder))
        self.odd = not self.odd  # no sensor repeats its reading for long
        volts = np.nan if "h" in missing else hall(self.fine + noise) + 1e-9 * self.odd
        return self.show(Sample(self.s.time + DT, encoder, volts, 0.0, 1.0, 0.0))

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.tick()

    def until(self, mode: str, most: float = 2.0) -> None:
        for _ in range(round(most / DT)):
            if self.mode == mode:
                return
            self.tick()
        raise AssertionError(f"{mode} was not reached, but {self.mode}")


def ready(**rest: object) -> Follower:
    """Trusted at count 0, enabled."""
    f = Follower(**{"coordinate": 0.0, "trusted": True, **rest})
    f.tick()
    f.ask(Enable())
    return f
