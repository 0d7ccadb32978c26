"""The package from Python: run a programme in memory, and measure its moves.

import macromicro

run = macromicro.run("thesis")
print(run["laser"], macromicro.moves(run))
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any, cast

from macromicro.design import served
from macromicro.design import tracking as following
from macromicro.design.tracking import Tracking
from macromicro.errors import naming_arguments
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.rig.opening import TWIN
from macromicro.runs import judging
from macromicro.schema import config, keys
from macromicro.schema.text import is_toml, read_toml
from macromicro.settings import Settings

PathLike = str | os.PathLike[str]


def load_settings(path: PathLike) -> Any:
    """The default settings of a machine, overridden by a TOML file as by ``--config``.

    Parameters
    ----------
    path : PathLike
        File of settings of any machine (see ``macromicro config show``); a key that it lacks keeps
        its default. A file that names no machine is for the two-stage machine.

    Returns
    -------
    Any
        The whole tree, of the two-stage machine a `Settings`; units as in its parameters'
        annotations.

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
    from macromicro.machines import compositions

    return compositions.settings_of(Path(path))


def run(
    what: PathLike | Programme | None = None,
    programme: PathLike | Programme | None = None,
    *,
    seed: int = 0,
    cycles: int = 1,
    fan: bool = False,
    settings: Any = None,
    rig: str = TWIN,
) -> Recording:
    """Run a programme on a simulated machine, or on a rig, in memory.

    The recording has the columns and numbers that ``macromicro run`` writes for the same arguments;
    save it with ``Recording.save``. The first run on a machine compiles it, which takes about 10 s.

    Parameters
    ----------
    what : PathLike | Programme | None, optional
        The settings file of a machine of any kind (it has a key ``machine``); else a programme of
        the two-stage machine, its file, or the name of a shipped example.
    programme : PathLike | Programme | None, optional
        The programme of the machine of `what`, its file, or the name of an example; default: the
        machine's usual moves.
    seed : int, optional
        Seed of the sensor noise: the same seed gives the same rows, bit for bit.
    cycles : int, optional
        Number of repetitions of a programme of moves.
    fan : bool, optional
        Whether the fan cools the wires.
    settings : Any, optional
        Settings of the machine, such as those of `load_settings` with changes; default: those of
        its file, or the nominal two-stage machine.
    rig : str, optional
        "twin" for the simulated machine of the settings, "MODULE:FACTORY" or "FILE.toml" of a rig,
        which moves at once and is not asked for, or "replay:FILE" for the sensors of a recording.

    Returns
    -------
    Recording
        One row per control period. If the guard stopped the run, a warning says why, the
        recording ends there, and its attribute ``finished`` is 0. If moves did not arrive, an
        `ArrivalWarning` names them.

    Raises
    ------
    InputError
        An argument, the programme or the settings are not accepted.
    """
    from macromicro.machines import setups

    keys.seed(seed, "seed")
    path = None
    if programme is not None or _is_machine(what):
        path, what = Path(os.fspath(cast("PathLike", what))), programme
    with naming_arguments():
        setup = setups.of(path, what, settings=settings, cycles=cycles, fan=fan)
        on = setup.open(setup.source(rig, seed), seed)
    done = setup.record(on=on, seed=seed, warn=True)
    if done.outcome.fault is not None:
        warnings.warn(f"the run was stopped: {done.outcome.fault.text}", stacklevel=2)
    return done.recording


def _is_machine(what: PathLike | Programme | None) -> bool:
    """Whether it is a settings file that names or describes a machine."""
    if what is None or isinstance(what, Programme):
        return False
    path = Path(os.fspath(what))
    return is_toml(path.name) and path.is_file() and config.MACHINE in read_toml(path, config.WHAT)


def moves(recording: Recording, settings: Any = None) -> list[Any]:
    """How each move went: arrival, settling, final error, overshoot, in the units of a table.

    Needs nothing but the recording: stages and targets are read from its references. A stage whose
    targets change all the time makes no moves: see `tracking`.

    Parameters
    ----------
    recording : Recording
        A run, or a recording of the live machine. In the latter the moves are those to a given
        place, without homing and jogs; macro targets are where its encoder counted them.
    settings : Any, optional
        Settings of the run, of which encoder and tolerances matter; default: those that the
        recording tells.

    Returns
    -------
    list[Any]
        One entry per move, in order: a `design.response.MoveResult` of the two-stage machine, a
        `machines.results.MoveResult` of one stage, a `JointMove` of several. None for a recording
        without rows.

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
    if not served.is_live(recording):
        from macromicro.machines import compositions, results

        found = compositions.of_recording(recording)
        if found is not None:
            machine, own = found
            planned = results.planned_moves(machine, recording)
            return results.of(machine, recording, planned, own if settings is None else settings)
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
