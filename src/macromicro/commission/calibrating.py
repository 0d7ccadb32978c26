"""The last step of a commissioning: a calibration, on the rig as it stands."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.calibration import files, procedure
from macromicro.calibration.procedure import Calibration, Request
from macromicro.calibration.references import ANGLES, INSTRUMENTS, LENGTHS, Instrument
from macromicro.calibration.request import CHANNEL
from macromicro.commission._verifying import Shifted
from macromicro.machines import composite
from macromicro.machines.composite import AnyMachine
from macromicro.machines.rig import CompiledTwin
from macromicro.machines.stage import Kind
from macromicro.place import LENGTH
from macromicro.rig.session import BENCH, Fixture
from macromicro.schema.config import INCLUDE

TITLE = "calibration"
POSITIONS, RUNS = 16, 2  # as a person would: the stage is read period by period, and so is a twin


class ReferencedTwin(CompiledTwin):
    """A simulated stage with an instrument beside it, as channel of its reference."""

    def __init__(self, kind: Kind, settings: Any, seed: int = 0) -> None:
        super().__init__(kind, settings, seed)
        self.channels = (*self.channels, CHANNEL)
        self._instrument = instrument(kind)
        self._errors = np.random.default_rng([seed, 230])
        self._walk, self._last = 0.0, 0.0

    def read(self) -> Any:
        sample = super().read()
        step = math.sqrt((sample.t - self._last) / 60.0)
        self._walk += step * self._errors.standard_normal()
        self._last = sample.t
        shown = self._instrument.shown(self.true_position(), self._walk, self._errors)
        return sample._replace(laser=float(shown))


def instrument(kind: Kind) -> Instrument:
    """What usually measures such a stage."""
    return INSTRUMENTS[(LENGTHS if kind.place == LENGTH else ANGLES)[0]]


def calibrate(
    machine: AnyMachine,
    settings: Any,
    on: tuple[Shifted, ...],
    seed: int,
    ask: Callable[[str, str], None],
    done: Callable[[str], None],
) -> Calibration:
    """Calibrate against the channel of the reference."""
    period = composite.period(machine, settings)
    rigs = tuple(Fixture("", BENCH, lambda _, one=one: one, one.channels, period) for one in on)  # type: ignore[misc]
    kind = machine.stages[0][1].kind
    what = (machine, settings, instrument(kind), POSITIONS, RUNS, seed)
    request = Request(*what, rigs=rigs)
    ask(TITLE, procedure.intent(request))
    found = procedure.calibrate(request)
    done(TITLE)
    return found


def include_corrections(toml: str) -> str:
    """A machine's file with the corrections beside it."""
    return f'{INCLUDE} = "{files.CORRECTIONS}"\n\n{toml}'
