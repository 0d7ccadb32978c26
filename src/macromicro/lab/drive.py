"""One stage driven without a programme: open loop, or under one law all the time.

Each drive takes the compiled virtual bench, or any rig, sample by sample and through the guard;
both give the same bits. The carriage's law is never parked, as the sequence of a programme would
do, so stiction and chatter stay visible.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from macromicro import loop
from macromicro.arrays import Array
from macromicro.columns import Column, quantities
from macromicro.control import macro as control
from macromicro.control import pi, settings
from macromicro.control.macro import MacroLaw
from macromicro.control.pi import PiAntiWindup
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample as StageSample
from macromicro.errors import ProblemError
from macromicro.kernel import compiled
from macromicro.lab import carriage
from macromicro.lab.carriage import MacroBench
from macromicro.lab.machine import Machine, play, visible_columns
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import NOISES, Truth
from macromicro.recorded import Inside, columns_named
from macromicro.recording import Recording
from macromicro.rig.guarded import IDLE
from macromicro.rig.session import Fixture
from macromicro.rig.twin import noise_source
from macromicro.types import Command, Outputs, Sample

DT = PERIOD

PUSHED = columns_named("t", "macro_position", "motor")
FOLLOWED = columns_named("t", "macro_reference", "macro_position", "motor", "macro_integral")
HEATED = columns_named("t", "ctrl", "laser", "hall_voltage", "contract", "true_micro", "true_wire")
BY_LASER = columns_named("t", "micro_reference", "ctrl", "laser", "true_micro")
# Quantity behind each column, and its scale there.
_BEHIND = {
    note.column: (name, note.scale)
    for kind in (Sample, Command, Outputs, Inside, Truth)
    for name, note in quantities(kind).items()
}


def law(name: str) -> MacroLaw:
    """A law of the macro-stage with the gains and compensation of the thesis.

    Parameters
    ----------
    name : str
        `pid`, `pd-initial` or `pd-tuned`.

    Returns
    -------
    MacroLaw
        Gains and compensation for the drives below.

    Examples
    --------
    >>> from macromicro.lab.drive import law
    >>> law("pd-tuned").limit  # V
    5.0
    """
    return settings.prepare(Control(macro_law=name)).macro


def open_loop(machine: Machine, volts: npt.ArrayLike, start: float) -> Recording:
    """The carriage in open loop.

    Parameters
    ----------
    machine : Machine
        The virtual bench's parameters, or a rig.
    volts : array_like, shape (n,)
        V at the D/A, a sample each ms.
    start : float
        Position of rest, counts.

    Returns
    -------
    Recording
        Columns t, macro_position and motor.

    Raises
    ------
    InputError
        The rig lacks an encoder.
    """
    sent = np.ascontiguousarray(volts, dtype=np.float64)
    found = _move(machine, "an open-loop run of the macro-stage", None, sent, start)
    return recorded(machine, PUSHED, found)


def closed_loop(
    machine: Machine, controller: MacroLaw, reference: npt.ArrayLike, start: float = 0.0
) -> Recording:
    """The carriage under a law.

    Parameters
    ----------
    machine : Machine
        The virtual bench's parameters, or a rig.
    controller : MacroLaw
        The law.
    reference : array_like, shape (n,)
        counts, a sample each ms.
    start : float, optional
        Position of rest, counts.

    Returns
    -------
    Recording
        Columns `FOLLOWED`.

    Raises
    ------
    InputError
        The rig lacks an encoder.
    """
    targets = np.ascontiguousarray(reference, dtype=np.float64)
    found = _move(machine, "the macro-stage under control", controller, targets, start + 0.5)
    return recorded(machine, FOLLOWED, {"macro_reference": targets, **found})


def heated(machine: Machine, ctrl: npt.ArrayLike, seed: int = 0, every: int = 1) -> Recording:
    """The micro-stage in open loop, from cold and fully extended.

    Parameters
    ----------
    machine : Machine
        The virtual bench's parameters, or a rig.
    ctrl : array_like, shape (n,)
        CTRL, V, a sample each ms.
    seed : int, optional
        Seed of the sensor noise.
    every : int, optional
        Each `every`-th sample is recorded.

    Returns
    -------
    Recording
        Columns `HEATED`.

    Raises
    ------
    InputError
        `ctrl` is not a list of voltages, or the rig lacks a laser.
    """
    sent = np.ascontiguousarray(ctrl, dtype=np.float64)
    if sent.ndim != 1 or len(sent) < 2 * every or not np.isfinite(sent).all() or every < 1:
        problem = f"its shape is {sent.shape}, or a value is not finite"
        raise ProblemError("CTRL profile", problem, "Give a list of voltages, one each ms.")
    what = "an open-loop run of the micro-stage"
    found = drive(machine, what, ("laser",), sent, seed=seed, every=every)
    return recorded(machine, HEATED, found, every * DT, {"seed": seed})


def by_laser(
    machine: Machine, target: float, p: PiAntiWindup, seconds: float, seed: int = 0
) -> Recording:
    """The micro-stage held at a place by the laser instead of the Hall sensor, from cold.

    Parameters
    ----------
    machine : Machine
        The virtual bench's parameters, or a rig.
    target : float
        Target, m.
    p : PiAntiWindup
        The law.
    seconds : float
        Duration, s.
    seed : int, optional
        Seed of the sensor noise.

    Returns
    -------
    Recording
        Columns `BY_LASER`.

    Raises
    ------
    InputError
        The rig lacks a laser.
    """
    targets = np.full(round(seconds / DT), target)
    found = drive(machine, "control by the laser", ("laser",), targets, law=p, seed=seed)
    return recorded(machine, BY_LASER, {"micro_reference": targets, **found}, about={"seed": seed})


def drive(
    machine: Machine,
    what: str,
    channels: tuple[str, ...],
    targets: Array,
    *,
    law: PiAntiWindup | None = None,
    motor: Array | None = None,
    start: float | None = None,
    seed: int = 0,
    every: int = 1,
) -> dict[str, Array]:
    """The whole bench, the micro-stage from cold and fully extended.

    Parameters
    ----------
    machine : Machine
        The virtual bench's parameters, or a rig.
    what : str
        Name of the run, for messages.
    channels : tuple[str, ...]
        Channels that the rig must measure.
    targets : ndarray, shape (n,)
        One sample per ms: CTRL (V), or the position (m) that `law` holds by the laser.
    law : PiAntiWindup | None, optional
        None for an open loop.
    motor : ndarray | None, optional
        V at the D/A of the macro-stage's motor, shape (n,); None for none.
    start : float | None, optional
        Position of rest of the carriage, counts; None where it stands.
    seed : int, optional
        Seed of the sensor noise.
    every : int, optional
        Each `every`-th sample is given back.

    Returns
    -------
    dict[str, Array]
        By name: t (s), encoder (counts), motor, ctrl (V), laser (m), hall (V), contract, and of the
        virtual bench micro (contraction, m) and wire (deg C); shape (n / every,) each.

    Raises
    ------
    InputError
        The rig lacks one of `channels`.
    """
    given = np.stack([np.zeros_like(targets) if motor is None else motor, targets])
    p = PiAntiWindup() if law is None else law
    if isinstance(machine, Fixture):
        machine.need(what, *channels)
        watched = 1.0 if machine.has("hall") else 0.0  # the guard follows it by the Hall sensor
        hold = _hold(p, law is not None, given, watched)
        done = play(machine, what, len(targets), hold, seed=seed, start=start)
        return {name: row[::every] for name, row in done.items()}
    noise = noise_source(seed).standard_normal((len(targets), NOISES))
    out = np.empty((len(loop.STAGE), -(-len(targets) // every)))
    begin = bench.initial(machine, (start or 0.0) * machine.encoder.pitch)
    compiled(loop.stage)(machine, begin, p, law is not None, given, noise, out, every, DT)
    t = np.arange(out.shape[1], dtype=np.float64) * every * DT
    return {"t": t, "motor": given[0, ::every], **dict(zip(loop.STAGE, out, strict=True))}


def recorded(
    machine: Machine,
    columns: tuple[Column, ...],
    found: dict[str, Array],
    dt: float = DT,
    about: dict[str, int] | None = None,
) -> Recording:
    """What `drive` gave, as a recording.

    Parameters
    ----------
    machine : Machine
        The virtual bench's parameters, or a rig; a rig's recording has what it measures.
    columns : tuple[Column, ...]
        Columns of the recording.
    found : dict[str, Array]
        Arrays by name.
    dt : float, optional
        Sample time, s.
    about : dict[str, int] | None, optional
        Attributes.

    Returns
    -------
    Recording
        In the columns' units.
    """
    attributes: dict[str, int | str] = {**(about or {})}
    if isinstance(machine, Fixture):
        columns = visible_columns(machine, columns)
        attributes = {"seed": 0, "rig": machine.name, **attributes}
    behind = (_BEHIND[c.name] for c in columns)
    return Recording.from_arrays(columns, [found[n] * k for n, k in behind], dt, {**attributes})


def _hold(
    p: PiAntiWindup, closed: bool, given: Array, watched: float
) -> Callable[[int, Sample], tuple[Command, Outputs]]:
    """The period of `loop.stage` for `play`; a missing reading gives no CTRL."""
    integral = 0.0

    def hold(k: int, sample: Sample) -> tuple[Command, Outputs]:
        nonlocal integral
        motor, target, ctrl = float(given[0, k]), float(given[1, k]), 0.0
        if not closed:
            return IDLE, Outputs(motor, target, 0.0, 0.0)
        if not math.isnan(sample.laser):
            integral, ctrl = pi.step(p, integral, target - sample.laser, DT)
        command = Command(0.0, 0.0, target, watched, math.nan)
        return command, Outputs(motor, ctrl, 0.0, 0.0)

    return hold


def _move(
    machine: Machine, what: str, controller: MacroLaw | None, targets: Array, start: float
) -> dict[str, Array]:
    """A run of the carriage from `start` [counts, half a count in], open loop without a law."""
    p, closed = controller or law("pd-tuned"), controller is not None
    if isinstance(machine, Fixture):
        machine.need(what, "encoder")
        period, integral = _follow(p, closed, targets)
        done = play(machine, what, len(targets), period, start=math.floor(start))
        return {**done, "macro_integral": integral}
    part = MacroBench(machine.amplifier, machine.macro, machine.encoder, machine.macro_steps)
    rows = carriage.run(part, p, closed, targets, start)
    t = np.arange(len(targets)) * DT
    return {"t": t, **dict(zip(("encoder", "motor", "macro_integral"), rows, strict=True))}


def _follow(
    p: MacroLaw, closed: bool, targets: Array
) -> tuple[Callable[[int, Sample], tuple[Command, Outputs]], Array]:
    """The period of `carriage.rollout` for `play`, and the array of its integral effort.

    A missing reading gives no effort and leaves the memory as it is; the guard limits that.
    """
    memory = control.begun(p)
    integral = np.zeros_like(targets)

    def follow(k: int, sample: Sample) -> tuple[Command, Outputs]:
        nonlocal memory
        target, motor = float(targets[k]), 0.0
        if not (closed and math.isnan(sample.encoder)):
            reading = StageSample(k * DT, sample.encoder)
            memory, motor = carriage.effort(p, memory, closed, target, reading, DT)
        integral[k] = control.integral(memory)
        command = Command(target, 1.0, 0.0, 0.0, 0.0) if closed else IDLE
        return command, Outputs(motor, 0.0, 0.0, 0.0)

    return follow, integral
