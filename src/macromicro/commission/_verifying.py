"""Verification of the gains on the axis: moves that nothing was fitted to."""

from __future__ import annotations

from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np

from macromicro.commission import _moves as moves
from macromicro.commission.stand import Stand
from macromicro.machines import machine as machines
from macromicro.machines import planning, results, runs
from macromicro.machines.results import MoveResult
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.types import SAFE, Outputs, Sample

SHARES = (0.15, 0.85, 0.86, 0.4, 0.39, 0.9, 0.05)  # of the travel: long moves and short ones
HOLD = 0.3  # s
SEED = 7  # of the places, which differ a little from SHARES


class Verified(NamedTuple):
    recording: Recording  # of the run
    moves: list[MoveResult]  # those that began
    asked: int  # number of moves
    fault: str  # of the guard; "" for none

    @property
    def met(self) -> bool:
        return not self.fault and results.arrived(self.moves) == self.asked


class Shifted:
    """A rig with its zero at the present position, a positive effort counting up."""

    channels = ("encoder",)

    def __init__(self, stand: Stand) -> None:
        self._rig, self._sign, self._check = stand.rig, stand.sign, stand.check
        self._facing = stand.facing
        self._zero = stand.zero + round(self._facing * stand.position() / stand.pitch)
        self.clock = stand.rig.clock

    def read(self) -> Sample:
        sample: Sample = self._rig.read()
        return sample._replace(encoder=self._facing * (sample.encoder - self._zero))

    def write(self, outputs: Outputs) -> None:
        self._check()
        self._rig.write(SAFE._replace(motor=self._sign * outputs.motor))

    def stop(self) -> None:
        self._rig.stop()

    def __enter__(self) -> Self:
        self._rig.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._rig.__exit__(kind, error, trace)


def programme(settings: Any) -> Programme:
    """Test moves within this machine's travel, in counts."""
    random = np.random.Generator(np.random.PCG64(SEED))
    shares = np.array(SHARES) + random.uniform(-0.004, 0.004, len(SHARES))
    meaning = "the moves that verify a commissioning"
    return moves.programme("verification", meaning, shares.tolist(), HOLD, settings)


def verify(stand: Stand, machine: machines.Machine, settings: Any) -> Verified:
    return made(stand, machine, settings, programme(settings))


def made(stand: Stand, machine: machines.Machine, settings: Any, what: Programme) -> Verified:
    """Run any moves from the present position."""
    done = runs.record(machine, settings, what, on=Shifted(stand), warn=False)
    plan = planning.plan(what, settings)
    found = results.moves(done.recording, plan, settings.arrival, machine.kind.place)
    fault = done.outcome.fault
    words = "" if fault is None else f"{fault.message} {fault.evidence}"
    return Verified(done.recording, found, len(plan.target), words)
