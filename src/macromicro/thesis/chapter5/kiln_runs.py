"""First-order curves in the kiln (Section 5.2.1, Figure 5.3), and profiles to test them.

A thermostat switches the heater's relay so that the thermocouple passes turning temperatures,
up and down in turn. It sees only the thermocouple, spikes included.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.kernel import compiled, kernel
from macromicro.recording import Recording
from macromicro.rig.fixtures import KILN_PERIOD, KilnOutputs
from macromicro.rig.session import Fixture
from macromicro.rig.twin import noise_source
from macromicro.thesis import kiln_bench
from macromicro.thesis.kiln_bench import KILN_NOISES, Kiln, KilnPlant, KilnState

COLUMNS = (
    Column("t", "s", "time since the start"),
    Column("thermocouple", "degC", "thermocouple on the top plate"),
    Column("encoder", "count", "contraction, encoder reading"),
    Column("position", "mm", "contraction by the encoder"),
    Column("heater", "1", "relay of the heater", "i1"),
    Column("true_thermocouple", "degC", "bench truth: temperature of the thermocouple itself"),
    Column("true_wire", "degC", "bench truth: wire temperature"),
    Column("true_position", "mm", "bench truth: contraction"),
)
_SHOWN = COLUMNS[:5]
# Heated beyond full contraction (107.5 degC), then to falling maxima, close to each other
# where the branch is steep, each time cooled to where nothing of the transformation is left.
MAXIMA = (
    114.0,
    *(float(v) for v in np.arange(109.0, 99.0, -1.0)),
    *(float(v) for v in np.arange(99.0, 57.0, -2.5)),
)
COLD = 31.0
COOLED = 2.0  # K above the room, in which nothing cools to its very temperature
HOTTEST = 45.0  # degC: the profiles' lows lie above
# Spikes of interference are over within 5.5 s; what lasts longer is temperature.
CONFIRM_S = 6.0
LONGEST_S = 24 * 3600.0
_CHUNK = 20_000


class Thermostat(NamedTuple):
    turns: Array  # turning temperatures [degC], first up
    confirm: int  # samples beyond a turning point that confirm it


class ThermostatState(NamedTuple):
    leg: int  # index of the next turning point
    beyond: int  # samples in a row beyond it


@kernel
def command(
    p: Thermostat, s: ThermostatState, thermocouple: float
) -> tuple[ThermostatState, float]:
    """State and relay (0 or 1) after a reading [degC]; leg = len(turns) means finished."""
    leg, beyond = s.leg, s.beyond
    if leg >= len(p.turns):
        return s, 0.0
    heating = leg % 2 == 0
    past = thermocouple >= p.turns[leg] if heating else thermocouple <= p.turns[leg]
    beyond = beyond + 1 if past else 0
    if beyond >= p.confirm:
        leg, beyond = leg + 1, 0
    on = 1.0 if leg < len(p.turns) and leg % 2 == 0 else 0.0
    return ThermostatState(leg, beyond), on


@kernel
def _rollout(
    plant: KilnPlant,
    s: KilnState,
    p: Thermostat,
    c: ThermostatState,
    tick: int,
    noise: Array,
    out: Array,
    dt: float,
) -> tuple[KilnState, ThermostatState, int]:
    """Closed loop until the thermostat is finished or `out` is full.

    Columns as COLUMNS, without the encoder's position. Returns the states and the samples written.
    """
    n = 0
    while n < out.shape[1] and c.leg < len(p.turns):
        draw = kiln_bench.drawn(noise, n)
        sample = kiln_bench.measure(plant, s, (tick + n) * dt, draw)
        c, on = command(p, c, sample.thermocouple)
        out[0, n] = sample.t
        out[1, n] = sample.thermocouple
        out[2, n] = sample.encoder
        out[3, n] = on
        out[4, n] = s.thermocouple
        out[5, n] = s.wire.temperature
        out[6, n] = s.wire.x
        s = kiln_bench.advance(plant, s, on, draw, dt)
        n += 1
    return s, c, n


def _check_turns(turns: Sequence[float], ambient: float) -> Array:
    """The turning temperatures as an array; InputError where they do not alternate."""
    t = np.asarray(turns, dtype=np.float64)
    accepted = f"temperatures up and down in turn, the first and all lows above {ambient} degC"
    steps = np.diff(t)
    if t.ndim != 1 or not t.size or not np.isfinite(t).all() or t.min() <= ambient:
        raise InputError("kiln profile", list(np.ravel(t)), accepted)
    if np.any(steps[::2] >= 0.0) or np.any(steps[1::2] <= 0.0):
        raise InputError("kiln profile", list(t), accepted)
    return t


def _beyond_reach(leg: int, turn: float) -> InputError:
    reach = f"temperatures that the kiln reaches in {LONGEST_S / 3600.0:g} h"
    return InputError(f"kiln profile, turns[{leg}]", turn, reach)


def run(plant: Kiln, turns: Sequence[float], seed: int = 0, dt: float = KILN_PERIOD) -> Recording:
    """A cold start, then the thermocouple through `turns` [degC], recorded every `dt` [s].

    A rig is recorded as often as it measures. InputError for a profile that does not turn or that
    the kiln cannot reach.
    """
    if isinstance(plant, Fixture):
        return _on_rig(plant, turns, seed)
    points = _check_turns(turns, plant.oven.ambient)
    p = Thermostat(points, max(round(CONFIRM_S / dt), 1))
    s, c, tick = kiln_bench.initial(plant), ThermostatState(0, 0), 0
    random = noise_source(seed)
    advance = compiled(_rollout)
    blocks = []
    while c.leg < len(points):
        if tick * dt > LONGEST_S:
            raise _beyond_reach(c.leg, float(points[c.leg]))
        out = np.empty((7, _CHUNK))
        noise = random.standard_normal((_CHUNK, KILN_NOISES))
        s, c, n = advance(plant, s, p, c, tick, noise, out, dt)
        blocks.append(out[:, :n])
        tick += n
    t, shown, counts, heater, couple, wire, x = np.concatenate(blocks, axis=1)
    place = counts * plant.encoder.pitch * 1e3
    arrays = [t, shown, counts, place, heater, couple, wire, x * 1e3]
    return Recording.from_arrays(COLUMNS, arrays, dt, {"seed": seed})


def _on_rig(rig: Fixture, turns: Sequence[float], seed: int) -> Recording:
    """The same on a rig, sample by sample, with its channels only.

    Missing readings switch the heater off, and end the run after 6 s.
    """
    rig.need("the kiln's procedure", "thermocouple", "encoder")
    p = Thermostat(_check_turns(turns, -273.15), max(round(CONFIRM_S / rig.dt), 1))
    c, silent, k = ThermostatState(0, 0), 0, 0
    rows = []
    with rig.open(seed) as session:
        session.idle(rig.rest)
        session.restart()
        while c.leg < len(p.turns):
            if k * rig.dt > LONGEST_S:
                raise _beyond_reach(c.leg, float(p.turns[c.leg]))
            sample = session.read()
            c, on = command(p, c, sample.thermocouple)
            silent = silent + 1 if math.isnan(sample.thermocouple) else 0
            if silent > p.confirm:
                lost = "no reading from the thermocouple, the heater is off; check its plug"
                raise MacromicroError(f"{rig.name}: {lost}")
            on = 0.0 if silent else on
            place = sample.encoder * rig.pitch * 1e3
            rows.append((sample.t, sample.thermocouple, sample.encoder, place, on))
            session.write(KilnOutputs(on))
            session.clock.wait(rig.dt)
            k += 1
    about: dict[str, str | int | float] = {"seed": seed, "rig": rig.name}
    return Recording.from_arrays(_SHOWN, np.array(rows).T, rig.dt, about)


def cycles(maxima: Sequence[float] = MAXIMA, cold: float = COLD) -> list[float]:
    """Turning temperatures [degC] of heating cycles with the given maxima."""
    return [turn for top in maxima for turn in (float(top), cold)]


def profiles(cold: float = COLD) -> list[list[float]]:
    """New profiles with minor loops (Figure 5.9), whose turns are on no measured curve."""
    return [
        [104.2, 71.3, 96.5, 78.4, 101.1, 62.0, 88.7, 45.0, 106.3, 84.9, 98.2, cold],
        [92.3, 52.7, 84.1, 58.2, 99.8, 66.6, 94.4, 73.0, 103.0, 48.5, 78.3, cold],
        [111.0, 58.5, 101.7, 66.1, 97.2, 70.9, 93.9, cold],
    ]


def coldest(plant: Kiln, seed: int = 0) -> float:
    """Temperature [degC] to which a kiln cools: a little above its room.

    InputError for a kiln that is still hot, or whose room is as warm as the profiles' lows.
    """
    if not isinstance(plant, Fixture):
        return max(COLD, float(plant.oven.ambient) + COOLED)
    room = _ambient_reading(plant, seed)
    if not room <= HOTTEST - COOLED:
        found = f"it reads {room:.1f} degC before the kiln is heated"
        remedy = f"Let it cool to {HOTTEST - COOLED:g} degC or less, or check the thermocouple."
        raise ProblemError(f"{plant.name}, thermocouple", found, remedy)
    return max(COLD, room + COOLED)


def _ambient_reading(rig: Fixture, seed: int) -> float:
    """Reading [degC] of an unheated kiln's thermocouple, without spikes."""
    shown = []
    with rig.open(seed) as session:
        session.idle(rig.rest)
        session.restart()
        for _ in range(max(round(2.0 * CONFIRM_S / rig.dt), 1)):
            shown.append(session.read().thermocouple)
            session.write(KilnOutputs(0.0))
            session.clock.wait(rig.dt)
    return float(np.median(shown))


class KilnData(NamedTuple):
    curves: Recording
    tests: list[Recording]


def collect(plant: Kiln, seed: int) -> KilnData:
    """The whole procedure, about half a day of the kiln's time."""
    cold = coldest(plant, seed)
    tests = [run(plant, turns, seed + 1 + k) for k, turns in enumerate(profiles(cold))]
    return KilnData(run(plant, cycles(cold=cold), seed), tests)
