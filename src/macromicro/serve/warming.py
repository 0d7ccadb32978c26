"""Runs everything once before the first period, so that nothing is compiled or imported later."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from macromicro.control.live import messages as m
from macromicro.control.live import parameters
from macromicro.kernel import cache_folder
from macromicro.plant import bench
from macromicro.rig.guard import Guard
from macromicro.rig.guarded import CompiledGuarded
from macromicro.rig.twin import CompiledTwin, Twin
from macromicro.serve._launching import fresh_python
from macromicro.serve.link import Outbox, pair
from macromicro.serve.persist import Restored
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import Shared
from macromicro.serve.ticking import Loop

if TYPE_CHECKING:
    from macromicro.serve._machine import Guard as Guarded
    from macromicro.serve._machine import Machine
    from macromicro.serve.live import Live
    from macromicro.serve.settings import AnySettings

_KERNELS = ("twin._bench", "guarded._guard", "surveying._survey")
_REST = 200  # periods within which a motion is braked, and the carriage seen to stand
_ARRIVAL = 400  # periods within which a short move of the carriage is on target and settling


def requests(live: parameters.Live) -> tuple[tuple[Any, int], ...]:
    """The requests of the rehearsal with their periods, moves first."""
    near, jogs = live.limits, live.jogging
    contraction = 0.5 * (near.micro_low + near.micro_high)
    counts = min(max(20.0, near.macro_low), near.macro_high)
    return (
        (m.Stop(), 2),  # nothing is enabled before the first sample, which is seen behind it
        (m.Enable(), 10),
        (m.Fan(True), 10),
        (m.MoveMicro(contraction), 40),
        (m.Stop(), 10),
        (m.Jog(m.MICRO, -jogs.micro), 40),
        (m.Jog(m.MICRO, 0.0), 10),
        (m.MoveMacro(counts), _ARRIVAL),
        (m.MoveTo(0.5 * (near.whole_low + near.whole_high), replace=True), 40),
        (m.EmergencyStop(), 10),
        (m.ClearFault(), 10),
        (m.Enable(), 10),
        (m.Jog(m.MACRO, min(jogs.slow, jogs.macro)), 40),
        (m.Jog(m.MACRO, 0.0), _REST),
        (m.Home(), 40),
        (m.Stop(), _REST),
        (m.Fan(False), 10),
        (m.Disable(), 10),
    )


def is_compiled() -> bool:
    """Whether the compiler's cache seems to hold the live two-stage machine."""
    folder = cache_folder()
    return all(any(folder.rglob(f"{name}-*.nbi")) for name in _KERNELS)


@contextmanager
def others_beside() -> Iterator[None]:
    """While the block compiles the bench, another process compiles the other kernels."""
    if is_compiled():
        yield
        return
    code = "from macromicro.serve.warming import others; others()"
    process = subprocess.Popen(
        **fresh_python(code), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield
    except BaseException:
        process.kill()
        raise
    finally:  # it may have failed: then they are compiled here
        process.wait()


def others() -> None:
    """Compile guard and survey, on a bench that is not compiled."""
    from macromicro import hall_table
    from macromicro.rig import guard
    from macromicro.serve import live

    settings = LiveSettings()
    table = hall_table.of_bench(settings)
    twin = Twin(bench.prepare(settings.bench, settings.sensors), 0)
    guarded = CompiledGuarded(twin, guard.prepare(settings.guard, table), settings.period)
    rehearse(guarded, live.make(settings, table), settings, ((m.Stop(), 2),))


def warm(machine: Live, limits: Guard, settings: LiveSettings) -> None:
    """Drive a machine on a virtual bench through the same loop, as fast as possible."""
    plain = LiveSettings()
    twin = CompiledTwin(bench.prepare(plain.bench, plain.sensors), 0)
    guarded = CompiledGuarded(twin, limits, settings.period)
    rehearse(guarded, machine, settings, requests(settings.live))


def rehearse(
    guarded: Guarded, machine: Machine, settings: AnySettings, asked: Sequence[tuple[Any, int]]
) -> None:
    """Run everything of a period once: from a known position, and from an unknown one."""
    shared, period = Shared.create(256, settings.telemetry), settings.period
    ours, theirs = pair()
    offsets = (0.0,) * len(settings.axes)
    starts = [Restored(True, 0.0, "warming", offsets), Restored(False, math.nan, "warming")]
    if not getattr(machine, "searches", True):  # it is trusted whatever is known from before
        del starts[1]
    try:
        loop = Loop(guarded, machine, shared, Outbox(theirs), settings.serve, period, False)
        with guarded:
            for start in starts:
                machine.begin(guarded.read(), start)
                loop.rehearse(asked)
    finally:
        ours.close()
        theirs.close()
        shared.close()
