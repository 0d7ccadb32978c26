"""The virtual bench at the pins of the simulated board, period by period."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from boardsim.avr import PERIOD, Avr
from macromicro.kernel import compiled
from macromicro.nominal import FULL_SCALE
from macromicro.plant import bench
from macromicro.plant.bench import Noise, Plant, Truth
from macromicro.rig.twin import noise_source
from macromicro.settings import Settings
from macromicro.types import SAFE, Outputs

LATCHED = 4_000  # cycles of a period behind which its outputs stand still
SWITCHES = (-0.001, 0.201)  # m; beyond the travel, before the stops
CONVERTER = 0.5 * FULL_SCALE / 1024  # V, rms: noise of the microcontroller's converter, half a code
_GRAY = (0, 1, 3, 2)  # channels A (bit 0) and B (bit 1) at counts 0 to 3


class Bench:
    """The board in front of the bench. Nothing here depends on the simulating machine's load.

    Outputs act in the period in which the board puts them out; the encoder's edges are spread over
    the rest of it.

    Parameters
    ----------
    elf : Path
        The firmware.
    seed : int, optional
        Of the sensors' noise.
    settings : Settings | None, optional
        Of the bench.
    processor : Callable[[Path], Any], optional
        Makes what the firmware runs in: `Avr`, or `boardsim.mps2.Mps2`.
    """

    def __init__(
        self,
        elf: Path,
        seed: int = 0,
        settings: Settings | None = None,
        processor: Callable[[Path], Any] = Avr,
    ) -> None:
        chosen = settings or Settings()
        self.plant: Plant = bench.prepare(chosen.bench, chosen.sensors)
        self.avr = processor(elf)
        self.tick = 0
        self.cut = ""  # encoder_a or encoder_b is stuck; "": none
        self.shorted = False  # both channels of the encoder show A
        self.hall: float | None = None  # V at the converter in place of the sensor's
        self.forced: dict[str, int] = {}  # lines that do not show what is so
        self.switches: tuple[float, float] | None = None  # m, where the limit switches trip
        self.motor = self.ctrl = 0.0  # V, as put out in the last period
        self.state = bench.initial(self.plant)
        self._random = noise_source(seed)
        self._advance = compiled(bench.advance)
        self._advance(self.plant, bench.initial(self.plant), SAFE, Noise(), 1e-3)  # compile it now
        self._place = self._counts()
        self._lines()
        self._channels(self._place, None)

    def _counts(self) -> int:
        return math.floor(self.state.macro.x / self.plant.encoder.pitch + 1e-9)

    def _channels(self, place: int, when: int | None) -> None:
        code = _GRAY[place % 4]
        for bit, name in enumerate(("encoder_a", "encoder_b")):
            if name != self.cut:
                self.avr.pin(name, (code if self.shorted else code >> bit) & 1, when)

    def tripped(self) -> tuple[bool, bool]:
        """Whether the carriage is beyond the lower, the upper limit switch."""
        if self.switches is None:
            return False, False
        return self.state.macro.x < self.switches[0], self.state.macro.x > self.switches[1]

    def _lines(self) -> None:
        micro, (low, high) = self.state.micro, self.tripped()
        levels = {
            "extend": int(micro.wire.x <= self.plant.micro.driver.extend_on),
            "contract": int(micro.cut > 0.5),
            "bridge_fault": 1,
            "limit_low": int(low),
            "limit_high": int(high),
        }
        for name, level in (levels | self.forced).items():
            self.avr.pin(name, level)

    def _hall(self, volts: float) -> None:
        self.avr.hall(volts if self.hall is None else self.hall)

    def period(self) -> None:
        """Let a control period pass."""
        began = self.tick * PERIOD
        rms = math.hypot(self.plant.hall.noise, CONVERTER)
        noise = rms * self._random.standard_normal(16)
        for k in range(4):
            self._hall(self.state.hall + noise[k])
            self.avr.run(began + (k + 1) * LATCHED // 4)
        motor, wire = self.avr.duties()
        self.motor, self.ctrl = FULL_SCALE * motor, FULL_SCALE * wire
        before, hall = self._place, self.state.hall
        # The bench's own converter holds an output back for a period: here it acts at once.
        state = self.state._replace(motor=self.motor, ctrl=self.ctrl)
        out = Outputs(self.motor, self.ctrl, 0.0, 0.0)
        self.state = self._advance(self.plant, state, out, Noise(), 1e-3)
        self._place = self._counts()
        self._edges(before, began)
        rest = PERIOD - LATCHED
        for k in range(12):
            share = (k + 1) / 12
            self._hall(hall + share * (self.state.hall - hall) + noise[4 + k])
            self.avr.run(began + LATCHED + (k + 1) * rest // 12)
        self._lines()
        self.tick += 1

    def _edges(self, before: int, began: int) -> None:
        moved = self._place - before
        step = 1 if moved > 0 else -1
        for k in range(1, abs(moved) + 1):
            when = began + LATCHED + (PERIOD - LATCHED) * k // (abs(moved) + 1)
            self._channels(before + step * k, when)

    def truth(self) -> Truth:
        """The bench's true quantities."""
        return bench.truth(self.plant, self.state)

    def outputs(self) -> np.ndarray:
        """Motor and CTRL of the last period, V, and whether the bridge is enabled."""
        return np.array([self.motor, self.ctrl, float(self.avr.level("enable"))])
