"""The frequency response of each stage of any machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.drawing.bar import progress
from macromicro.errors import ProblemError
from macromicro.machines import compositions, sweeping
from macromicro.machines.machine import Machine
from macromicro.report import bode, macro_bode
from macromicro.report.bode import Shown
from macromicro.settings import Settings, choose

LOW, HIGH = 0.005, 0.3  # of the loop's frequency


class Asked(NamedTuple):
    """Frequencies (Hz; None: the usual ones), their number, and the seed."""

    low: float | None
    high: float | None
    number: int
    seed: int


def stages(config: Path | None, asked: Asked) -> dict[str, Callable[[], Shown]]:
    """What measures each stage of a machine, by its name; of the two-stage one its model."""
    if config is None or compositions.is_two_stage(config):
        settings = choose(Settings(), config, None)
        linear = macro_bode.find(settings, asked.low, asked.high, asked.number)
        return {"": lambda: linear}
    stages = compositions.each(config)
    for _, machine, _ in stages:
        if machine.model is None:
            raise ProblemError(
                "--config",
                f"the machine {machine.name} has no linear model",
                "Choose a machine that has one, such as axis.",
            )
    return {
        name: partial(_measure, name, machine, settings, asked)
        for name, machine, settings in stages
    }


def _measure(name: str, machine: Machine, settings: Any, asked: Asked) -> Shown:
    model, dt = machine.model, settings.timing.period
    assert model is not None  # as the command has looked
    low = LOW / dt if asked.low is None else asked.low
    high = HIGH / dt if asked.high is None else asked.high
    frequency = sweeping.frequencies(low, high, asked.number, dt)
    of = f"axis {name}" if name else f"the {machine.kind.name}"
    with progress(f"response of {of}", "frequencies") as pace:
        found = sweeping.measure_response(
            machine,
            settings,
            frequency,
            lambda f: model(settings, f),
            seed=asked.seed,
            progress=pace.reach,
        )
    return bode.Found(machine, settings, found, model(settings, frequency), asked.seed)
