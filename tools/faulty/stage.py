"""Simulated stages of any machine with faults that can be switched on while they run.

Example:

    export PYTHONPATH=tools MACROMICRO_FAULTS=/tmp/faults
    export MACROMICRO_MACHINE=examples/machines/printer.toml
    macromicro serve --config $MACROMICRO_MACHINE --rig faulty.stage:stage
    python -m faulty encoder-frozen     # in another shell; "none" ends it
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import faulty
from macromicro.errors import ProblemError
from macromicro.machines import compositions
from macromicro.machines import machine as machines
from macromicro.machines.machine import Machine
from macromicro.machines.rig import CompiledTwin
from macromicro.types import Lines, Outputs
from macromicro.types import Sample as Shown

MACHINE = "MACROMICRO_MACHINE"
_WIDE = 8.0  # standard deviations of a sensor's noise in what the machine tells apart
_BRIEF = 1e-3  # s


class FaultyStage(CompiledTwin):
    """The twin of a stage behind faults; its board shows the noiseless sensor in m."""

    def __init__(
        self,
        machine: Machine,
        settings: Any,
        seed: int = 0,
        cells: NDArray[np.float64] | None = None,
    ) -> None:
        super().__init__(machine.kind, settings, seed)
        self.cells = faulty.board() if cells is None else cells
        self.counted = True
        encoder, travel = settings.encoder, settings.travel
        grain = max(1.0, round(_WIDE * encoder.noise / self.pitch))
        absolute = machine.touch is None
        leap = (travel.high - travel.low) / 4.0 / 500.0 / self.pitch if absolute else 1.0
        self._injection = faulty.Injection(self.cells, grain, leap, absolute=absolute)
        self._most = float(settings.guard.effort)
        self._forced: dict[str, float] = {}

    @property
    def place(self) -> float:
        """What a noiseless sensor would show."""
        kept = self._noise.copy()
        self._noise[:] = 0.0
        place = self._measured(self.tick * self.dt)
        self._noise[:] = kept
        return place

    def read(self) -> Shown:
        """Measure now, through the present fault (counts)."""
        now, place, injection = self.tick * self.dt, self.place, self._injection
        injection.look(now, place)
        self.cells[faulty.CARRIAGE] = self.cells[faulty.STAGE] = place
        if injection.fault.lines or self._forced:
            self._force(now)
        true = super().read()
        return true._replace(t=injection.time(true.t), encoder=injection.count(true.encoder))

    def _force(self, now: float) -> None:
        """Force lines by the fault; release those of the previous one."""
        fault = self._injection.fault
        for name in self._forced:
            self.injected.pop(name, None)
        over = fault.brief and now - self.cells[faulty.ONSET] > _BRIEF - 0.5 * self.dt
        self._forced = {} if over else dict.fromkeys((name for name, _ in fault.lines), 0.0)
        for name, how in fault.lines if self._forced else ():
            if how == "cut":
                self.cut(name)
            else:
                self.injected[name] = 1.0 if how == "on" else 0.0

    def _said(self) -> Lines:
        said = super()._said()
        if self._injection.fault.swapped:
            return said._replace(limit_low=said.limit_high, limit_high=said.limit_low)
        return said

    def write(self, outputs: Outputs) -> None:
        """Set the outputs of the coming period, except those that are cut."""
        motor = outputs.motor
        legal = abs(motor) <= self._most
        self._injection.written(self.tick * self.dt, legal, motor)
        passed = self._injection.passed({"motor": motor})
        super().write(outputs._replace(**passed) if passed else outputs)

    def _advanced(self, effort: float) -> None:
        if not self._injection.fault.blocked:
            super()._advanced(effort)

    def stop(self) -> None:
        self._injection.written(self.tick * self.dt, True, 0.0)
        super().stop()


def _file() -> Path:
    path = os.environ.get(MACHINE)
    if not path:
        raise ProblemError(MACHINE, "not set", "Set it to the path of the machine's settings file.")
    return Path(path)


def stage(seed: int) -> FaultyStage:
    """The stage of the settings in MACROMICRO_MACHINE."""
    found, settings = machines.load(_file())
    return FaultyStage(found, settings, seed, faulty.board(os.environ.get(faulty.BOARD)))


def x(seed: int) -> FaultyStage:
    """The first axis of the settings in MACROMICRO_MACHINE."""
    return _axis(0, seed, os.environ.get(faulty.BOARD))


def y(seed: int) -> FaultyStage:
    """The second axis."""
    path = os.environ.get(faulty.BOARD)
    return _axis(1, seed, f"{path}.y" if path else None)


def _axis(k: int, seed: int, path: str | None) -> FaultyStage:
    _, machine, tree = compositions.each(_file())[k]
    return FaultyStage(machine, tree, seed, faulty.board(path))
