"""The package from Python: run a programme in memory, and measure its moves.

import macromicro

run = macromicro.run("thesis")
print(run["laser"], macromicro.moves(run))
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path

from macromicro import programme as programmes
from macromicro.design import served
from macromicro.design import tracking as following
from macromicro.design.response import MoveResult
from macromicro.design.tracking import Tracking
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.rig import faults
from macromicro.rig.opening import TWIN
from macromicro.runs import arrivals, judging, programmed
from macromicro.runs.job import DEFAULT, load, place
from macromicro.schema import config, keys
from macromicro.settings import Settings

PathLike = str | os.PathLike[str]
_REMEDY = (
    "Try a longer hold, or gains for this machine (macromicro tune). "
    "macromicro.moves(run) shows how each move went."
)


def load_settings(path: PathLike) -> Settings:
    """The default settings, overridden by a TOML file as by ``--config``.

    Parameters
    ----------
    path : PathLike
        File of settings (see ``macromicro config show``); a key that it lacks keeps its default.

    Returns
    -------
    Settings
        The whole tree; units as in its parameters' annotations.

    Raises
    ------
    InputError
        The file cannot be read, or a key or a value is not accepted; names file and key.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro import load_settings
    >>> with TemporaryDirectory() as folder:
    ...     written = Path(folder, "own.toml").write_text('bench.friction.coulomb = "11 N"')
    ...     load_settings(Path(folder, "own.toml"))["bench.friction.coulomb"]
    11.0
    """
    return config.load_overrides(Path(path), Settings())


def run(
    programme: PathLike | Programme = DEFAULT,
    *,
    seed: int = 0,
    cycles: int = 1,
    fan: bool = False,
    settings: Settings | None = None,
    rig: str = TWIN,
) -> Recording:
    """Run a programme on the virtual bench, or on a rig, in memory.

    The recording has the columns and numbers that ``macromicro run`` writes for the same arguments;
    save it with ``Recording.save``. The first run on a machine compiles the bench, which takes
    about 10 s.

    Parameters
    ----------
    programme : PathLike | Programme, optional
        A programme, its file, or the name of a shipped example.
    seed : int, optional
        Seed of the sensor noise: the same seed gives the same rows, bit for bit.
    cycles : int, optional
        Number of repetitions of a programme of moves.
    fan : bool, optional
        Whether the fan cools the wires.
    settings : Settings | None, optional
        Bench, sensors, controller and guard; default: the nominal machine.
    rig : str, optional
        "twin" for the virtual bench of the settings, "MODULE:FACTORY" or "FILE.toml" of a rig,
        which moves at once and is not asked for, or "replay:FILE" for the sensors of a recording.

    Returns
    -------
    Recording
        One row per control period (1 ms). If the guard stopped the run, a warning says why, the
        recording ends there, and its attribute ``finished`` is 0. If moves did not arrive, an
        `ArrivalWarning` names them.

    Raises
    ------
    InputError
        An argument, the programme or the settings are not accepted.
    """
    settings = Settings() if settings is None else settings
    keys.seed(seed, "seed")
    config.check(settings, "settings")
    if not isinstance(programme, Programme):
        programme = load(programmes.find(os.fspath(programme)), settings)
    on = place(rig, seed, settings)
    done = programmed.record(programme, settings, on=on, seed=seed, fan=fan, cycles=cycles)
    fault = faults.describe(done.outcome.watch)
    if fault is not None:
        text = f"{fault.message} {fault.evidence}. {fault.remedy}"
        warnings.warn(f"the run was stopped: {text}", stacklevel=2)
    numbers = programme.repeated(cycles).numbers
    arrivals.warn(arrivals.of_both(judging.moves(done.recording, settings), numbers), _REMEDY)
    return done.recording


def moves(recording: Recording, settings: Settings | None = None) -> list[MoveResult]:
    """How each move went: arrival, settling, final error, overshoot, in the units of a table.

    Needs nothing but the recording: stages and targets are read from its references. A stage whose
    targets change all the time makes no moves: see `tracking`.

    Parameters
    ----------
    recording : Recording
        A run, or a recording of the live machine. In the latter the moves are those to a given
        place, without homing and jogs; macro targets are where its encoder counted them.
    settings : Settings | None, optional
        Settings of the run, of which the encoder and the macro tolerance matter; default: those
        that the recording tells.

    Returns
    -------
    list[MoveResult]
        One entry per move, in order; none for a recording without rows.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro import Recording, moves
    >>> from macromicro.recording import Column
    >>> names = "t", "move", "phase", "macro_reference", "micro_reference", "macro_position"
    >>> t = 0.1 * np.arange(20)  # s; the carriage moves (1) until the end of the run (4)
    >>> rows = [t, 0 * t, np.where(t < 1.9, 1, 4), 0 * t + 100, 0 * t, np.minimum(200 * t, 100)]
    >>> run = Recording.from_arrays([Column(n, "-", n) for n in names], rows, 0.1, {})
    >>> moves(run)[0].settling_s
    0.5
    """
    return judging.moves(recording, settings)


def tracking(recording: Recording, settings: Settings | None = None) -> list[Tracking]:
    """How each stage followed targets that change all the time: RMS and peak error, lag.

    Parameters
    ----------
    recording : Recording
        A run whose programme gives targets by time.
    settings : Settings | None, optional
        Settings of the run, of which the encoder matters; default: those that the recording tells.

    Returns
    -------
    list[Tracking]
        One entry per stage that was moved so; none for a recording of moves, which `moves` is for.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro import Recording, tracking
    >>> from macromicro.recording import Column
    >>> names = "t", "move", "phase", "macro_reference", "micro_reference", "macro_position"
    >>> k = np.arange(100)  # a new target in each row; the carriage moves (1), a row late
    >>> rows = [0.1 * k, k, 0 * k + 1, 10 * k, 0 * k, 10 * k - 10]
    >>> run = Recording.from_arrays([Column(n, "-", n) for n in names], rows, 0.1, {})
    >>> round(tracking(run)[0].lag_s, 6)
    0.1
    """
    settings = judging.settings_of(recording) if settings is None else settings
    if not len(recording) or served.is_live(recording):
        return []
    what = served.ran(recording)[1]
    return following.tracking(recording, what, pitch=settings.sensors.encoder.pitch)
