"""Open-loop records of a single-stage machine within its limits, for `identify`."""

# Axis: random strokes from rest, braked to rest. Piezo stage: slow voltage ramps with minor loops.
# Wire: slow effort ramps from contracted down to several positions and up again.

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.commission._exciting import excite
from macromicro.commission._probing import Direction, Ends
from macromicro.commission.courses import Corner, course, play
from macromicro.commission.stand import Caution, CommissionError, Stand
from macromicro.errors import InputError, ProblemError
from macromicro.machines import rig as machine_rig
from macromicro.machines import sheets, stage, wire_sheets
from macromicro.machines.machine import Machine, as_toml
from macromicro.machines.stage import Bounds, Driven
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.session import Session
from macromicro.types import Rig

_STROKES = (
    Column("t", "s", "time since the start"),
    Column("u", "V", "effort at the D/A"),
    Column("x", "m", "position by the encoder"),
)
_LOOPS = (
    Column("t", "s", "time since the start"),
    Column("u", "V", "voltage at the stack"),
    Column("f", "um", "position by the sensor"),
)
_CURVES = (
    Column("t", "s", "time since the start"),
    Column("u", "V", "effort"),
    Column("f", "um", "contraction by the sensor"),
)
TURNS = tuple(round(0.1 * k, 1) for k in range(1, 10))  # shares of the window, from its top
SLOW = 60.0  # time constants of the wire that a ramp through the window takes
ROWS = 200_000
BEYOND = 0.2  # of the window, on either side
SPEED = 0.9  # of the machine's greatest
# Of the effort at which the amplifier's current or range is all given, so that it never limits:
PUSH, SPARE = 0.6, 0.7  # share for the strokes; or that of what is left above friction
EMF = 0.9  # of the rest: the back-EMF that braking adds
CREEP = 0.1
CORNERS = (0.93, 0.04, 0.93, 0.29, 0.79, 0.36, 0.64)  # of the amplifier's range, one after another
SLOPE = 1.0  # of that range in a second
PACE = 200.0  # rows a second that are kept of a slow record


class Given(NamedTuple):
    machine: Machine
    tree: Any
    rig: Rig | None
    seed: int


class Noted(Session):
    """A session that logs each period: time (s), effort set after it (V), count."""

    def __init__(self, rig: Any, dt: float) -> None:
        super().__init__(rig, dt)
        self.rows: list[tuple[float, float, float]] = []
        self._given = 0.0

    def write(self, outputs: Any) -> None:
        super().write(outputs)
        self._given = outputs.motor

    def wait(self, dt: float) -> None:
        sample = self.read()
        self.rows.append((sample.t, self._given, sample.encoder))
        super().wait(dt)


class Procedure(NamedTuple):
    name: str  # as the command names it
    machines: tuple[str, ...]  # names of the machines that it is for
    # runs it; asks whether somebody wants it to end
    collect: Callable[[Given, Callable[[], bool]], Recording]
    gives: str  # meaning of the record
    then: str  # next command; {out} is the folder of the recording


def strokes(given: Given, ended: Callable[[], bool] = lambda: False) -> Recording:
    """Strokes of an axis at several efforts above breakaway, within the travel."""
    tree, place = given.tree, given.machine.kind.place
    per_newton, weight = sheets.per_newton(tree), sheets.weight(tree)
    rubbing = tree.friction
    heaviest, newton = sheets.heaviest(tree), place.named("N")
    if heaviest >= rubbing.coulomb:
        raise CommissionError(
            f"the weight ({heaviest:.3g} {newton}) exceeds the friction "
            f"({rubbing.coulomb:.3g} {newton}): the axis moves without effort, and strokes "
            "cannot end at rest"
        )
    starts = rubbing.coulomb + rubbing.stribeck + rubbing.ripple + heaviest - abs(weight)
    up, down = per_newton * (starts + weight), per_newton * (starts - weight)
    found = Direction(1.0, up, down, 0.0, 1.0)
    rig: Any = given.rig
    if rig is None:
        rig = machine_rig.CompiledTwin(given.machine.kind, given.tree, given.seed)
    dt = float(tree.timing.period)
    full = min(sheets.force(tree) * per_newton, tree.guard.effort)
    emf = max(tree.controller.ahead_velocity, 1e-12)
    most = max(up, down)
    effort = max(PUSH * full, most + SPARE * (full - most))
    speed = min(SPEED * tree.motion.velocity, EMF * (full - effort) / emf)
    caution = Caution(effort, speed)
    with Noted(rig, dt) as session:
        stand = Stand(session, dt, tree.encoder.pitch, ended)
        ends = Ends(tree.travel.low, tree.travel.high, False)
        excite(stand, found, ends, caution, CREEP * tree.motion.velocity)
        rows = np.array(session.rows).T
    rows[2] = (rows[2] - rows[2, 0]) * tree.encoder.pitch
    about = {**_about(given), "gain": 1.0 / per_newton}
    columns = tuple(c._replace(unit=place.named(c.unit)) for c in _STROKES)
    return Recording.from_arrays(columns, rows, dt, about)


def ramps(given: Given, ended: Callable[[], bool] = lambda: False) -> Recording:
    tree = given.tree
    if given.rig is not None:
        remedy = "Remove --rig."
        raise ProblemError("--rig", "this experiment runs on the simulated stage only", remedy)
    dt, gain = float(tree.timing.period), float(tree.amplifier.gain)
    low, high = tree.amplifier.low, tree.amplifier.high
    corners = [0.0, *(low + share * (high - low) for share in CORNERS), 0.0]
    legs = [
        np.linspace(a, b, math.ceil(abs(b - a) / (SLOPE * (high - low) * dt)) + 1)[1:]
        for a, b in pairwise(corners)
    ]
    volts = np.concatenate(legs)
    seen = _simulate(given, volts / gain)
    every = max(round(1.0 / (PACE * dt)), 1)
    rows = np.array([seen.t, seen.effort * gain, seen.position * 1e6])[:, ::every]
    return Recording.from_arrays(_LOOPS, rows, every * dt, _about(given))


def curves(given: Given, ended: Callable[[], bool] = lambda: False) -> Recording:
    """First-order reversal curves of a wire, slow enough for the heat to follow the effort."""
    tree, dt = given.tree, float(given.tree.timing.period)
    heats = wire_sheets.heats(tree)
    cold, hot = _window(tree, heats.resistance)
    # What the transformation takes up counts as heat capacity while it lasts.
    capacity = heats.capacity + heats.latent / (tree.wire.heat_end - tree.wire.heat_start)
    rate = (hot - cold) / (SLOW * heats.resistance * capacity)
    corners = [Corner(hot, 0.0, rate), Corner(cold, 0.0, rate), Corner(hot, 0.0, rate)]
    for share in TURNS:
        corners += [Corner(hot - share * (hot - cold), 0.0, rate), Corner(hot, 0.0, rate)]
    efforts = course([Corner(cold, 1.0, rate), *corners, Corner(0.0, 0.0, rate)], dt)
    if given.rig is None:
        seen = _simulate(given, efforts)
        rows = np.array([seen.t, seen.effort, seen.position])
    else:
        rig: Any = given.rig
        sensor = tree.encoder
        with Session(rig, dt) as session:
            caution = Caution(hot, tree.guard.speed, sensor.low, sensor.high, 0.0)
            record = play(Stand(session, dt, sensor.pitch, ended), efforts, caution)
        rows = np.array([record.t, record.u, record.x])
    rows[2] *= 1e6
    every = max(math.ceil(rows.shape[1] / ROWS), 1)
    return Recording.from_arrays(_CURVES, rows[:, ::every], every * dt, _about(given))


def _simulate(given: Given, efforts: Array) -> Driven:
    """The simulated stage in open loop, within the bounds of its guard."""
    tree, kind = given.tree, given.machine.kind
    sensor, dt = tree.encoder, float(tree.timing.period)
    bounds = Bounds(sensor.low, sensor.high, tree.guard.speed, tree.guard.window)
    seen = stage.drive(kind, kind.prepare(tree), efforts, bounds, dt, seed=given.seed)
    if seen.ended:
        raise CommissionError(f"the stage met its bound {seen.ended!r}; nothing was written")
    return seen


def _window(tree: Any, resistance: float) -> tuple[float, float]:
    """Steady efforts that extend and contract the loaded wire, with a margin, V."""
    full, way = tree.driver.full_scale, wire_sheets.way(tree)
    extended = wire_sheets.shift_temperatures(tree, tree.bias.preload).cool_end
    contracted = wire_sheets.shift_temperatures(tree, wire_sheets.pull(tree, way)).heat_end
    per_kelvin = full / (wire_sheets.power(tree) * resistance)
    low, high = (per_kelvin * (at - tree.air.ambient) for at in (extended, contracted))
    more = BEYOND * (high - low)
    return max(low - more, 0.0), min(high + more, full)


def _about(given: Given) -> dict[str, Attribute]:
    return {
        "machine": given.machine.name,
        "seed": given.seed,
        "settings": as_toml(given.machine, given.tree),
    }


PROCEDURES = (
    Procedure(
        "drive",
        ("axis", "rotary"),
        strokes,
        "strokes both ways at five levels of the effort, within the travel",
        "macromicro identify drive {out}/drive.h5",
    ),
    Procedure(
        "plays",
        ("piezo",),
        ramps,
        "slow ramps of the voltage, a large loop and minor ones",
        "macromicro identify plays {out}/plays.h5",
    ),
    Procedure(
        "curves",
        ("wire",),
        curves,
        "slow ramps of the effort, first-order reversal curves of the contraction",
        "macromicro identify hysteresis {out}/curves.h5 --shape nonnegative",
    ),
)


def find(name: str, machine: Machine) -> Procedure:
    mine = [p for p in PROCEDURES if machine.name in p.machines]
    for procedure in mine:
        if name in ("", procedure.name):
            return procedure
    names = ", ".join(p.name for p in mine)
    others = ", ".join(sorted({name for p in PROCEDURES for name in p.machines}))
    accepted = f"{names} for this machine" if mine else f"none for this machine; for: {others}"
    raise InputError("experiment", name or "nothing", accepted)
