"""Dead zone of the macro-stage (Section 4.2.3, Figure 4.8): low voltages from many places.

Only what a rig shows is used: commanded volts and encoder counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from macromicro.columns import COLUMNS
from macromicro.errors import InputError
from macromicro.experiments.machine import Machine, idle_law, play, recorded
from macromicro.identify.deadzone import DeadZone, dead_zone
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.plant import amplifier, carriage, encoder
from macromicro.plant.bench import Plant
from macromicro.plant.carriage import MacroState
from macromicro.recording import Recording
from macromicro.rig.session import Fixture

Array = npt.NDArray[np.float64]

DT = PERIOD
TRAVEL = (0.0, 2800.0)
VOLTAGES = tuple(float(v) for v in np.round(np.arange(2.6, 3.301, 0.05), 2))
STARTS = tuple(float(x) for x in range(0, 2601, 200))
SECONDS = 2.5
HIGHEST, STEP, MORE = 4.5, 0.05, 6  # V, V, further voltages at a time

_SHOWN = tuple(c for c in COLUMNS if c.name in ("t", "macro_position", "motor"))


@kernel
def _open_loop(p: Plant, s: MacroState, volts: Array, out: Array, dt: float) -> None:
    """Encoder counts into out[n] while the D/A board is sent volts[n], one period late."""
    latched = 0.0
    for k in range(len(volts)):
        out[k] = encoder.count(p.encoder, s.x)
        drive = amplifier.motor_volts(p.amplifier, latched)
        s = carriage.advance(p.macro, s, drive, dt, p.macro_steps)
        latched = amplifier.convert(p.amplifier, volts[k])


def open_loop(plant: Machine, volts: npt.ArrayLike, start: float) -> Recording:
    """One run: `volts` [V at the D/A] a sample each ms, from rest at `start` [counts].

    The recording has the columns t, macro_position and motor.
    """
    sent = np.ascontiguousarray(volts, dtype=np.float64)
    if isinstance(plant, Fixture):
        return _on_rig(plant, sent, start)
    out = np.empty_like(sent)
    s = carriage.at_rest(start * plant.encoder.pitch)
    compiled(_open_loop)(plant, s, sent, out, DT)
    arrays = {"t": np.arange(len(sent)) * DT, "macro_position": out, "motor": sent}
    return Recording.from_arrays(_SHOWN, [arrays[c.name] for c in _SHOWN], DT, {})


def _on_rig(rig: Fixture, volts: Array, start: float) -> Recording:
    """The same on any rig."""
    rig.need("an open-loop run of the macro-stage", "encoder")
    law = idle_law(volts, None)
    done = play(rig, "open loop of the macro-stage", len(volts), law, start=math.floor(start))
    values = {"t": done["t"], "macro_position": done["encoder"], "motor": done["motor"]}
    return recorded(rig, _SHOWN, values, DT, 0)


def collect(
    plant: Machine, voltages: Sequence[float] = VOLTAGES, starts: Sequence[float] = STARTS
) -> list[Recording]:
    """A run at each voltage [V], in both directions, from each start [counts, from its own end]."""
    runs = []
    n = round(SECONDS / DT)
    for v in voltages:
        for x in starts:
            # Half a count in, so that the encoder does not stand on an edge.
            runs.append(open_loop(plant, np.full(n, v), x + 0.5))
            runs.append(open_loop(plant, np.full(n, -v), TRAVEL[1] - x + 0.5))
    return runs


def probed(plant: Machine) -> tuple[list[Recording], DeadZone]:
    """The whole procedure (M1): its runs and the dead zone from them.

    Where the carriage still stops at the highest of `VOLTAGES`, higher ones are tried, up to
    4.5 V. Raises `InputError` where it stops there, too.
    """
    runs, top = collect(plant), VOLTAGES[-1]
    while True:
        try:
            return runs, dead_zone(runs, travel=TRAVEL)
        except InputError:
            if top >= HIGHEST:
                raise
        further = [round(top + STEP * (k + 1), 2) for k in range(MORE)]
        runs += collect(plant, further)
        top = further[-1]


def measured(plant: Machine) -> DeadZone:
    """Dead zone of a bench by the whole procedure (M1)."""
    return probed(plant)[1]
