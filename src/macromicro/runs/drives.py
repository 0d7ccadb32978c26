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
from macromicro.columns import Column
from macromicro.control import macro as control
from macromicro.control import pi, settings
from macromicro.control.macro import MacroLaw, Memory
from macromicro.control.pi import PiAntiWindup
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample as StageSample
from macromicro.control.stage_law import Target
from macromicro.errors import ProblemError
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.plant import amplifier, bench, carriage, encoder
from macromicro.plant.bench import NOISES, Plant
from macromicro.plant.carriage import MacroState
from macromicro.recorded import named
from macromicro.recording import Recording
from macromicro.rig.guarded import IDLE
from macromicro.rig.session import Fixture
from macromicro.rig.twin import noise_source
from macromicro.runs.machine import Machine, play, recorded
from macromicro.types import Command, Outputs, Sample

DT = PERIOD


PUSHED = named("t", "macro_position", "motor")
FOLLOWED = named("t", "macro_reference", "macro_position", "motor", "macro_integral")
HEATED = named("t", "ctrl", "laser", "hall_voltage", "contract", "true_micro", "true_wire")
BY_LASER = named("t", "micro_reference", "ctrl", "laser", "true_micro")


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
    >>> from macromicro.runs.drives import law
    >>> law("pd-tuned").limit  # V
    5.0
    """
    return settings.prepare(Control(macro_law=name)).macro


@kernel
def _motor(
    p: MacroLaw, memory: Memory, closed: bool, target: float, x: StageSample, dt: float
) -> tuple[Memory, float]:
    """Memory and volts [V]: by the law for `target` [counts] where `closed`, else `target` [V]."""
    if closed:
        return control.step(p, memory, Target(target, 0.0, 0.0, math.inf), x, dt)
    return memory, target


@kernel
def _carriage(
    plant: Plant, p: MacroLaw, closed: bool, s: MacroState, targets: Array, out: Array, dt: float
) -> None:
    """Counts, D/A volts and integral effort into the rows of `out`."""
    latched = 0.0
    memory = control.begun(p)
    for k in range(len(targets)):
        x = encoder.count(plant.encoder, s.x)
        memory, motor = _motor(p, memory, closed, targets[k], StageSample(k * dt, x), dt)
        out[0, k], out[1, k], out[2, k] = x, motor, control.integral(memory)
        drive = amplifier.motor_volts(plant.amplifier, latched, s.i)
        s = carriage.advance(plant.macro, s, drive, dt, plant.macro_steps)
        latched = amplifier.convert(plant.amplifier, motor)


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
    return _moved(machine, "an open-loop run of the macro-stage", None, sent, start)


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
    return _moved(machine, "the macro-stage under control", controller, targets, start + 0.5)


def _moved(
    machine: Machine, what: str, controller: MacroLaw | None, targets: Array, start: float
) -> Recording:
    """A run of the carriage from `start` [counts, half a count in], open loop without a law."""
    closed, shown = controller is not None, PUSHED if controller is None else FOLLOWED
    p = law("pd-tuned") if controller is None else controller
    if isinstance(machine, Fixture):
        machine.need(what, "encoder")
        follow, integral = _follow(p, closed, targets)
        done = play(machine, what, len(targets), follow, start=math.floor(start))
        rows = (done["t"], done["encoder"], done["motor"], integral)
    else:
        out = np.empty((3, len(targets)))
        s = carriage.at_rest(start * machine.encoder.pitch)
        p.machine(_carriage)(machine, p, closed, s, targets, out, DT)
        rows = (np.arange(len(targets)) * DT, *out)
    names = ("t", "macro_position", "motor", "macro_integral")
    values = {"macro_reference": targets, **dict(zip(names, rows, strict=True))}
    return _recording(machine, shown, values, DT, {})


def _follow(
    p: MacroLaw, closed: bool, targets: Array
) -> tuple[Callable[[int, Sample], tuple[Command, Outputs]], Array]:
    """The same law for `play`, and the array of its integral effort.

    A missing reading gives no effort and leaves the memory as it is; the guard limits that.
    """
    memory = control.begun(p)
    integral = np.zeros_like(targets)

    def follow(k: int, sample: Sample) -> tuple[Command, Outputs]:
        nonlocal memory
        target, motor = float(targets[k]), 0.0
        if not (closed and math.isnan(sample.encoder)):
            memory, motor = _motor(
                p, memory, closed, target, StageSample(k * DT, sample.encoder), DT
            )
        integral[k] = control.integral(memory)
        command = Command(target, 1.0, 0.0, 0.0, 0.0) if closed else IDLE
        return command, Outputs(motor, 0.0, 0.0, 0.0)

    return follow, integral


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
    found = stage(machine, what, ("laser",), sent, seed=seed, every=every)
    return _recording(machine, HEATED, _shown(found), every * DT, {"seed": seed})


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
    found = stage(machine, "control by the laser", ("laser",), targets, law=p, seed=seed)
    values = _shown(found) | {"micro_reference": targets * 1e3}
    return _recording(machine, BY_LASER, values, DT, {"seed": seed})


def stage(
    machine: Machine,
    what: str,
    channels: tuple[str, ...],
    targets: Array,
    *,
    law: PiAntiWindup | None = None,
    seed: int = 0,
    every: int = 1,
) -> dict[str, Array]:
    """The micro-stage alone, from cold and fully extended.

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
    seed : int, optional
        Seed of the sensor noise.
    every : int, optional
        Each `every`-th sample is given back.

    Returns
    -------
    dict[str, Array]
        By name: t (s), ctrl (V), laser (m), hall (V), contract, and of the virtual bench
        contraction (m) and wire (deg C); shape (n / every,) each.

    Raises
    ------
    InputError
        The rig lacks one of `channels`.
    """
    p = PiAntiWindup() if law is None else law
    if isinstance(machine, Fixture):
        machine.need(what, *channels)
        hold = _hold(p, law is not None, targets, 1.0 if machine.has("hall") else 0.0)
        done = play(machine, what, len(targets), hold, seed=seed)
        seen = ("t", "ctrl", "laser", "hall", "contract")
        return {name: done[name][::every] for name in seen}
    noise = noise_source(seed).standard_normal((len(targets), NOISES))
    out = np.empty((6, -(-len(targets) // every)))
    cold = bench.initial(machine)
    compiled(loop.stage)(machine, cold, p, law is not None, targets, noise, out, every, DT)
    t = np.arange(out.shape[1], dtype=np.float64) * every * DT
    ctrl, laser, hall, contract, contraction, wire = out
    return {
        "t": t,
        "ctrl": ctrl,
        "laser": laser,
        "hall": hall,
        "contract": contract,
        "contraction": contraction,
        "wire": wire,
    }


def _hold(
    p: PiAntiWindup, closed: bool, targets: Array, seen: float
) -> Callable[[int, Sample], tuple[Command, Outputs]]:
    """The same law for `play`. The guard follows it by the Hall sensor, if there is one."""
    integral = 0.0

    def hold(k: int, sample: Sample) -> tuple[Command, Outputs]:
        nonlocal integral
        target = float(targets[k])
        if not closed:
            return IDLE, Outputs(0.0, target, 0.0, 0.0)
        ctrl = 0.0
        if not math.isnan(sample.laser):
            integral, ctrl = pi.step(p, integral, target - sample.laser, DT)
        return Command(0.0, 0.0, target, seen, math.nan), Outputs(0.0, ctrl, 0.0, 0.0)

    return hold


def _shown(found: dict[str, Array]) -> dict[str, Array]:
    values = {
        "t": found["t"],
        "ctrl": found["ctrl"],
        "laser": found["laser"] * 1e6,
        "hall_voltage": found["hall"],
        "contract": found["contract"],
    }
    if "wire" in found:
        values |= {"true_micro": found["contraction"] * 1e3, "true_wire": found["wire"]}
    return values


def _recording(
    machine: Machine,
    columns: tuple[Column, ...],
    values: dict[str, Array],
    dt: float,
    about: dict[str, int],
) -> Recording:
    if isinstance(machine, Fixture):
        return recorded(machine, columns, values, dt, about.get("seed", 0))
    return Recording.from_arrays(columns, [values[c.name] for c in columns], dt, {**about})
