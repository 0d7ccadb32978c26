"""The virtual bench with faults."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from faulty import BOARD, CARRIAGE, STAGE, WIRE, Injection, board
from macromicro.control import calibration
from macromicro.plant import bench, carriage
from macromicro.rig.twin import Twin, VirtualClock
from macromicro.types import SAFE, Outputs, Sample


class Faulty(Twin):
    """The twin behind faults; without one it is the twin, bit for bit."""

    counted = True

    def __init__(self, *given: Any, cells: NDArray[np.float64], **more: Any) -> None:
        super().__init__(*given, **more)
        self.calibration = calibration.default_calibration()  # of the default bench, which this is
        self.clock = VirtualClock(self)
        self.cells = cells
        self._injection = Injection(cells)
        self._hall = 0.0

    def read(self) -> Sample:
        injection = self._injection
        injection.look(self.tick * self.dt, self.state.macro.x)
        true, fault = super().read(), injection.fault
        hall = true.hall
        if injection.fresh:
            self._hall = hall
        if fault.hall == "stuck":
            hall = self._hall
        elif isinstance(fault.hall, float) and not math.isnan(fault.hall):
            hall = fault.hall
        if fault.noise:
            hall += fault.noise * float(injection.random.standard_normal())
        count, t = injection.count(true.encoder), injection.time(true.t)
        sample = true._replace(t=t, encoder=count, hall=hall)
        return sample._replace(**dict.fromkeys(fault.silent, math.nan))

    def write(self, outputs: Outputs) -> None:
        """Set the outputs of the coming period, except those that are cut."""
        self._note(outputs)
        super().write(outputs._replace(**self._injection.passed(outputs._asdict())))

    def advance(self) -> None:
        if self._injection.fault.blocked:  # no motion, and none that the micro-stage could feel
            still = carriage.at_rest(self.state.macro.x)
            self.state = self.state._replace(macro=still, motor=0.0)
        super().advance()
        cells, state = self.cells, self.state
        cells[CARRIAGE] = state.macro.x
        cells[STAGE] = state.macro.x + state.micro.wire.x
        cells[WIRE] = state.micro.wire.temperature

    def stop(self) -> None:
        self._note(SAFE)
        super().stop()

    def _note(self, outputs: Outputs) -> None:
        motor, ctrl, fan, _ = outputs
        full = self.plant.amplifier.full_scale
        legal = abs(motor) <= full and 0.0 <= ctrl <= full and fan in (0.0, 1.0)
        self._injection.written(self.tick * self.dt, legal, motor, ctrl, fan)


def twin(seed: int) -> Faulty:
    """The default bench with its faults, compiled and called once."""
    from macromicro.kernel import compiled
    from macromicro.plant.bench import Bench, Sensors

    plant = bench.prepare(Bench(), Sensors())
    measure, advance = compiled(bench.measure), compiled(bench.advance)
    first = Twin(plant, 0, measure=measure, advance=advance)
    for _ in range(3):
        first.read()
        first.advance()
    cells = board(os.environ.get(BOARD))
    return Faulty(plant, seed, measure=measure, advance=advance, cells=cells)
