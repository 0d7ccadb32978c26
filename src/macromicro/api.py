"""The package from Python: run a programme in memory, and measure its moves.

import macromicro

run = macromicro.run("thesis")
print(run["laser"], macromicro.moves(run))
"""

from __future__ import annotations

import json
import os
import warnings
from pathlib import Path

import numpy as np
import numpy.typing as npt

import macromicro
from macromicro import config, simulate
from macromicro import programme as programmes
from macromicro.columns import COLUMNS
from macromicro.control.supervisor import MACRO, MICRO
from macromicro.design import response
from macromicro.design import tracking as following
from macromicro.design.response import MoveResult
from macromicro.design.tracking import Tracking
from macromicro.errors import InputError
from macromicro.experiments import hall_calibration
from macromicro.experiments.run import DEFAULT, MAX_SEED, load
from macromicro.loop import PERIOD
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.rig import faults
from macromicro.settings import Settings

PathLike = str | os.PathLike[str]


def load_settings(path: PathLike) -> Settings:
    """The defaults with what a TOML file overrides, as ``--config`` does it.

    Raises `InputError` that names file and key.
    """
    return config.load_overrides(Path(path), Settings())


def run(
    programme: PathLike | Programme = DEFAULT,
    *,
    seed: int = 0,
    cycles: int = 1,
    fan: bool = False,
    settings: Settings | None = None,
) -> Recording:
    """Run a programme (a file, an example's name) on the virtual bench, in memory.

    The recording has the columns and numbers that ``macromicro run`` writes for the same
    arguments; save it with ``Recording.save``. If the guard stops the run, a warning says
    why, and the recording ends there; its attribute ``finished`` is then 0. The first
    run on a machine compiles the bench, which takes about 10 s. Raises `InputError`.
    """
    settings = Settings() if settings is None else settings
    if not 0 <= seed <= MAX_SEED:
        raise InputError("seed", seed, f"a whole number from 0 to {MAX_SEED}")
    config.check(settings, "settings")
    if not isinstance(programme, Programme):
        programme = load(programmes.find(os.fspath(programme)), settings)
    what = programme.repeated(cycles)
    table = hall_calibration.for_bench(settings)
    blocks: list[npt.NDArray[np.float64]] = []
    outcome = simulate.simulate(settings, what, _Blocks(blocks), seed=seed, fan=fan, table=table)
    fault = faults.describe(outcome.watch)
    if fault is not None:
        text = f"{fault.message} {fault.evidence}. {fault.remedy}"
        warnings.warn(f"the run was stopped: {text}", stacklevel=2)
    attributes: dict[str, str | int | float] = {
        "version": macromicro.__version__,
        "programme": what.title,
        "seed": seed,
        "cycles": cycles,
        "fan": int(fan),
        "overrides": json.dumps(config.difference(settings, Settings())),
        "settings": config.as_toml(settings),
        "finished": int(outcome.finished),
    }
    return Recording.from_arrays(COLUMNS, np.concatenate(blocks, axis=1), PERIOD, attributes)


class _Blocks:
    """A sink in memory."""

    def __init__(self, blocks: list[npt.NDArray[np.float64]]) -> None:
        self._blocks = blocks

    def append(self, block: npt.NDArray[np.float64]) -> None:
        """Keep the block."""
        self._blocks.append(block)


def moves(recording: Recording, settings: Settings | None = None) -> list[MoveResult]:
    """How each move went: arrival, settling, final error, overshoot, in the units of a table.

    Needs nothing but the recording: stages and targets are read from its references.
    A stage whose targets change all the time makes no moves: `tracking` tells how it went.
    `settings`: those of the run, if its encoder or its macro tolerance were overridden.
    """
    settings = Settings() if settings is None else settings
    if not len(recording):
        return []
    begun, what = _moves_of(recording)
    done = response.moves(
        recording,
        what,
        pitch=settings.sensors.encoder.pitch,
        macro_band=settings.controller.sequence.tolerance,
        but=following.followed(recording, what),
    )
    return [move for move in done if begun[move.move]]


def tracking(recording: Recording, settings: Settings | None = None) -> list[Tracking]:
    """How each stage followed targets that change all the time: RMS and peak error, lag.

    Empty for a recording of moves, which `moves` is for. `settings`: those of the run, if its
    encoder was overridden.
    """
    settings = Settings() if settings is None else settings
    if not len(recording):
        return []
    what = _moves_of(recording)[1]
    return following.tracking(recording, what, pitch=settings.sensors.encoder.pitch)


def _moves_of(recording: Recording) -> tuple[npt.NDArray[np.bool_], Programme]:
    """Which of the recording's moves were begun, and the programme they belong to.

    A micro move that was due before the carriage had settled is counted, but never begun.
    """
    index, phase = recording["move"], recording["phase"]
    coarse, fine = recording["macro_reference"], recording["micro_reference"]
    count = int(index[-1]) + 1
    first = np.minimum(np.searchsorted(index, np.arange(count)), len(index) - 1)
    before = np.maximum(first - 1, 0)
    macro = phase[first] == MACRO
    fresh = (first == 0) | (phase[before] != MACRO) | (coarse[before] != coarse[first])
    micro = phase[first] == MICRO
    stage = np.where(macro & fresh, programmes.MACRO, programmes.MICRO)
    target = np.where(macro, coarse[first], fine[first] * 1e-3)
    none = np.full(count, np.nan)
    what = Programme("", none, stage.astype(np.int64), target, none, float("nan"), "")
    return (macro & fresh) | micro, what
