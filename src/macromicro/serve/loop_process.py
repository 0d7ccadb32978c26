"""The loop process: opens the rig, drives it and always leaves the outputs safe.

It ends on order, or when the serving process dies: by PR_SET_PDEATHSIG, or when that process'
heartbeat stops. It has a session of its own, so Ctrl-C does not reach it.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import math
import os
import signal
import sys
import traceback
from functools import partial
from types import FrameType
from typing import Any

from macromicro import hall_table
from macromicro.control import calibration
from macromicro.control.live import alone
from macromicro.control.live.messages import MICRO, STAGES
from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.rig import guard
from macromicro.rig import session as sessions
from macromicro.rig.guarded import CompiledGuarded
from macromicro.rig.opening import TWIN, open_rig
from macromicro.rig.session import BENCH, Session
from macromicro.rig.twin import CompiledTwin, Twin, VirtualClock
from macromicro.schema.text import printable
from macromicro.serve import _pacing, faults
from macromicro.serve._launching import Spec, take_over
from macromicro.serve._machine import Opened
from macromicro.serve.link import Outbox
from macromicro.serve.live import Live
from macromicro.serve.persist import Kept
from macromicro.serve.settings import LiveSettings, StageSettings
from macromicro.serve.shared import Shared
from macromicro.serve.ticking import ORPHANED, Loop
from macromicro.serve.warming import others_beside, warm

_PR_SET_PDEATHSIG = 1
_SESSION = sessions.__file__
FRAMES = 8  # innermost ones, of a traceback in the log


def main() -> None:
    """Run the loop process; the arguments are those of `_launching`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end, spec, shared = take_over(sys.argv[1:])
    outbox = Outbox(end)
    try:
        opened = open_machine(spec)
        opened.warm()
    except InputError as error:
        kind = "problem" if isinstance(error, ProblemError) else "refused"
        outbox.send((kind, error.where, printable(error.value, 300), error.accepted))
        sys.exit(1)
    except MacromicroError as error:
        outbox.send(("failed", str(error)))
        sys.exit(1)
    except Exception:
        outbox.send(("failed", traceback.format_exc(limit=-3)))
        sys.exit(1)
    session = Session(opened.rig, spec.settings.period)
    status = drive(spec, opened, session, shared, outbox)
    outbox.send(("left", session.unstopped))
    outbox.flush()
    outbox.end()
    sys.exit(status)


def open_machine(spec: Spec) -> Opened:
    """The machine of `spec`; nothing is switched on."""
    settings = spec.settings
    if isinstance(settings, StageSettings):
        from macromicro.serve.stage import opening

        return opening.open_machine(spec)
    if spec.rig == TWIN:
        with others_beside():
            rig = twin(settings, spec.seed, spec.kept)
        table = hall_table.of_bench(settings)
        return _two_stages(spec, settings, rig, guard.prepare(settings.guard, table), table, STAGES)
    fixture = open_rig(spec.rig, spec.seed, limits=settings.guard, gains=settings.controller)
    if fixture.kind != BENCH:
        problem = f"the rig is a {fixture.kind}"
        raise ProblemError(f"--rig {fixture.name}", problem, "Use a bench.")
    stages = alone.stages(fixture.channels)
    if not stages:
        shown = ", ".join(fixture.channels) or "nothing"
        remedy = "Use a rig that measures encoder (macro-stage), hall (micro-stage) or both."
        raise ProblemError(f"--rig {fixture.name}, channels", f"it measures {shown}", remedy)
    own = (
        fixture.calibrated() if MICRO in stages else calibration.default_calibration()
    )  # of no use
    rig = fixture.make(spec.seed)
    if hasattr(rig, "yielding"):  # homing takes a limit switch for the stop
        rig.yielding = True
    limits = guard.prepare(fixture.limits or settings.guard, own)
    opened = _two_stages(spec, settings, rig, limits, own, stages)
    paced = not isinstance(rig.clock, VirtualClock)
    return opened._replace(paced=paced, counted=fixture.counted)


def _two_stages(
    spec: Spec,
    settings: LiveSettings,
    rig: Any,
    limits: guard.Guard,
    table: calibration.Calibration,
    stages: tuple[str, ...],
) -> Opened:
    """The two-stage machine, or one of its stages, on the twin or a rig like it."""
    maker, _, function = spec.machine.partition(":")
    make = partial(getattr(importlib.import_module(maker), function), settings, table, stages)
    machine = make()
    if getattr(rig, "own_gains", False) and isinstance(machine, Live):
        machine.own_gains = True
    return Opened(
        rig,
        machine,
        lambda session: CompiledGuarded(session, limits, settings.period),
        lambda: warm(make(), limits, settings),
        counted=True,
        laser=lambda sample: sample.laser - calibration.position(table, sample.hall),
    )


def twin(settings: LiveSettings, seed: int, kept: Kept | str) -> Twin:
    """The virtual bench of these settings, compiled and called once."""
    from macromicro.plant import bench

    plant = bench.prepare(settings.bench, settings.sensors)
    first = CompiledTwin(plant, 0)
    for _ in range(3):
        first.read()
        first.advance()
    pitch, carriage = plant.encoder.pitch, plant.macro.carriage
    left = 0.0
    if (
        isinstance(kept, Kept)
        and kept.rig == settings.kept_as(TWIN)
        and math.isfinite(kept.encoder)
    ):
        left = min(max(kept.encoder * pitch, carriage.stop_low), carriage.stop_high - pitch)
    state = bench.initial(plant, left)
    return CompiledTwin(plant, seed, state=state)


def drive(spec: Spec, opened: Opened, session: Session, shared: Shared, outbox: Outbox) -> int:
    """Loop until ordered to end and return the exit status; the rig is always stopped."""
    rig = opened.guarded(session)
    timed = bool(getattr(opened.rig, "timed", False))
    settings = spec.settings
    serve, period = settings.serve, settings.period
    loop = Loop(rig, opened.machine, shared, outbox, serve, period, opened.paced, timed)
    _die_with(spec.parent, loop, serve.loop_timeout)
    granted = _pacing.prepare(serve)
    shared.ring[:] = 0.0  # every page is there before the first period
    gc.collect()
    gc.freeze()
    gc.disable()
    signal.signal(signal.SIGTERM, _on_interrupt)  # what comes behind leaving the rig, too
    try:
        with rig:
            outbox.send(("ready", granted, tuple(session.channels)))
            try:
                known = settings.kept_as(spec.rig)
                ending = loop.run(spec.kept, known, opened.witness)
            finally:  # no more periods come: leaving the rig has a time of its own
                outbox.send(("leaving",))
    except KeyboardInterrupt:
        outbox.send(("ended", "ended by a signal"))
        return 0
    except Exception as error:
        from_rig = _inside_rig(error)
        code = faults.RIG_FAILED if from_rig else faults.CONTROL_FAILED
        text = f"{type(error).__name__}: {error}"
        if not from_rig:
            outbox.send(("traceback", traceback.format_exc(limit=-FRAMES)))
        outbox.send(("trouble", faults.failure(code, text)))
        return 1
    if ending == ORPHANED:  # a server that was only halted hears of it later
        allowed = serve.parent_timeout
        outbox.send(("ended", faults.silent(loop.silence, allowed)))
    return 0


def _on_interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _inside_rig(error: Exception) -> bool:
    """Whether the rig raised the error, which is reached through a session; else the law."""
    frames = (frame for frame, _ in traceback.walk_tb(error.__traceback__))
    return any(frame.f_code.co_filename == _SESSION for frame in frames)


def _die_with(parent: int, loop: Loop, patience: float) -> None:
    """Have the kernel signal the death of the serving process.

    The signal reports the death of the parent's thread, so only a changed parent counts. On systems
    without it the missing heartbeat shows it, later.
    """
    if not hasattr(signal, "SIGUSR2"):
        return

    def dying(number: int, frame: FrameType | None) -> None:
        if os.getppid() != parent:
            orphaned()

    def orphaned() -> None:
        loop.orphaned = True
        # A rig that blocks just now would never let the loop see that.
        signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGTERM))
        signal.setitimer(signal.ITIMER_REAL, patience)

    signal.signal(signal.SIGUSR2, dying)
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGUSR2), 0, 0, 0)
    if os.getppid() != parent:
        orphaned()
