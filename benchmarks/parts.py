"""Time of each part of a control period, and of the macro-stage in C beside it."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import figures
import numpy as np

from macromicro import hysteresis, loop, simulate
from macromicro import programme as programmes
from macromicro.control import supervisor
from macromicro.export import files
from macromicro.export.units import Entry, Unit
from macromicro.kernel import compiled, kernel
from macromicro.loop import PERIOD
from macromicro.plant import bench, carriage, micro
from macromicro.recorded import ROWS, inside, note
from macromicro.rig import guard
from macromicro.settings import Settings
from macromicro.types import SAFE, Sample

REPEATS = 7
TICKS = 200_000
HALF = 250
DRIVE = 15.0  # at the motor, 3.75 V at the D/A


@kernel
def _macro(p: Any, s: Any, volts: float, half: int, ticks: int, steps: int) -> Any:
    for k in range(ticks):
        drive = volts if (k // half) % 2 == 0 else -volts
        s = carriage.advance(p, s, drive, 1e-3, steps)
    return s


@kernel
def _micro(p: Any, s: Any, ticks: int) -> Any:
    for k in range(ticks):
        s = micro.advance(p, s, 1.9 if (k // 1000) % 2 == 0 else 1.4, 0.0, 0.0, 1e-3)
    return s


@kernel
def _readings(k: int) -> Any:
    """Sensors that change all the time, so that the compiler can leave nothing out."""
    return Sample(k * 1e-3, 100.0 + k % 7, 2.5 + 1e-3 * (k % 11), 1e-6 * (k % 13), 0.0, 0.0)


@kernel
def _supervisor(p: Any, plan: Any, s: Any, ticks: int) -> Any:
    for k in range(ticks):
        s, _command, _out = supervisor.step(p, plan, s, _readings(k), 1e-3)
    return s


@kernel
def _guard(p: Any, s: Any, command: Any, out: Any, ticks: int) -> Any:
    for k in range(ticks):
        s, _given = guard.step(p, s, _readings(k), command, out, 1e-3)
    return s


@kernel
def _note(block: Any, sample: Any, command: Any, out: Any, s: Any, w: Any, real: Any) -> None:
    for k in range(block.shape[1]):
        note(block, k, sample, command, out, inside(s, w, 25.0), real)


@kernel
def _preisach(table: Any, memory: Any, path: Any) -> float:
    total = 0.0
    for k in range(len(path)):
        memory, share = hysteresis.advance(table, memory, path[k])
        total += share
    return total


def per_tick(run: Callable[[], Any], ticks: int = TICKS) -> float:
    """Median time [ns] a tick of `run`, which does `ticks` of them; the first is not counted."""
    return 1e9 * figures.timed(run, REPEATS) / ticks


def measure() -> dict[str, float]:
    """Nanoseconds a control period of every part."""
    limits = programmes.Limits(0.0, 2800.0, 0.0, 3.9e-3, 14000.0)
    what = programmes.load(programmes.find("thesis"), limits)
    rolled = simulate.prepare(Settings(), what)
    plant, state = rolled.plant, rolled.run.bench
    sample = bench.measure(plant, state, 0.0, bench.Noise())
    begun, command, _ = supervisor.step(
        rolled.control, rolled.plan, rolled.run.progress, sample, PERIOD
    )
    calm = command._replace(macro_active=0.0)
    block = np.empty((ROWS, 2000))
    steps = plant.macro_steps
    rest, start = carriage.at_rest(0.1), carriage.at_rest(0.05)
    path = 70.0 + 45.0 * np.sin(np.arange(TICKS) * 0.01) * np.cos(np.arange(TICKS) * 1.37e-3)
    fresh = guard.fresh()
    cold = hysteresis.fresh(plant.micro.table, 25.0)
    noise = np.random.default_rng(0).standard_normal((len(path) // 4, bench.NOISES))
    rows = np.empty((ROWS, len(noise)))
    fast = compiled(loop.rollout)
    parts: dict[str, Callable[[], Any]] = {
        "macro physics, moving": lambda: compiled(_macro)(
            plant.macro, start, DRIVE, HALF, TICKS, steps
        ),
        "macro physics, at rest": lambda: compiled(_macro)(
            plant.macro, rest, 0.0, HALF, TICKS, steps
        ),
        "micro physics": lambda: compiled(_micro)(plant.micro, state.micro, TICKS),
        "supervisor": lambda: compiled(_supervisor)(rolled.control, rolled.plan, begun, TICKS),
        "guard": lambda: compiled(_guard)(rolled.watchdog, fresh, calm, SAFE, TICKS),
        "Preisach advance": lambda: compiled(_preisach)(plant.micro.table, cold, path),
    }
    found = {
        "whole tick": per_tick(lambda: fast(*rolled, noise, rows, PERIOD), len(noise)),
        **{name: per_tick(run) for name, run in parts.items()},
    }
    found["note"] = per_tick(
        lambda: compiled(_note)(
            block, sample, command, SAFE, begun, fresh, bench.truth(plant, state)
        ),
        block.shape[1],
    )
    return found


_CALL = """
void ticks(double volts, int64_t half, int64_t count, int64_t steps, double *state)
{
    const CarriageMacroState end = macro_tick_run(&macro_tick_p, &macro_tick_s, volts, half, count,
                                                  steps);
    state[0] = end.x;
    state[1] = end.v;
}
"""


def macro_in_c() -> float | None:
    """Nanoseconds a moving macro tick in C (cc -O3), as the package exports it; None without a C
    compiler. Raises RuntimeError if C and the package disagree, for then nothing is compared."""
    import compiling  # one of the peers'

    settings = Settings()
    plant = bench.prepare(settings.bench, settings.sensors)
    p, start, steps = plant.macro, carriage.at_rest(0.05), plant.macro_steps
    entry = Entry("run", _macro, (p, start, DRIVE, HALF, TICKS, steps))
    written = files.write_unit(Unit("macro_tick", "ticks", (entry,), {"p": p, "s": start}))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "macro_tick.h").write_text(written.header)
        source = folder / "macro_tick.c"
        source.write_text(written.code + _CALL)
        try:
            place = compiling.library(str(source), folder)
        except compiling.NoCompilerError:
            return None
        function = ctypes.CDLL(str(place)).ticks
    pointer = np.ctypeslib.ndpointer(dtype=float)
    function.argtypes = [ctypes.c_double, *[ctypes.c_int64] * 3, pointer]
    function.restype = None

    def run(ticks: int = TICKS) -> Any:
        state = np.empty(2)
        function(DRIVE, HALF, ticks, steps, state)
        return state

    mine = compiled(_macro)(p, start, DRIVE, HALF, 2000, steps)
    if not np.array_equal(run(2000), [mine.x, mine.v]):
        raise RuntimeError(f"C ends at {run(2000)[0]} m, the package at {mine.x} m")
    return per_tick(run)
