"""The loop process: opens the rig, drives it, and never leaves it but with outputs safe.

It is started as ``python -c "from macromicro.serve.loop_process import main; main()" FDS``
in a session of its own, so that Ctrl-C in the terminal reaches only the serving process.
It ends when ordered to, and by itself when that process is dead: the kernel's death signal
(PR_SET_PDEATHSIG), and a heartbeat that no longer counts up.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import math
import os
import signal
import socket
import sys
import traceback
from collections.abc import Callable
from types import FrameType
from typing import Any, NamedTuple, Protocol

from macromicro import hall_table
from macromicro.control import calibration
from macromicro.control.live import alone
from macromicro.control.live.messages import MICRO, STAGES
from macromicro.errors import InputError, MacromicroError
from macromicro.rig import guard
from macromicro.rig.guarded import CompiledGuarded
from macromicro.rig.opening import TWIN, open_rig
from macromicro.rig.session import BENCH, Session
from macromicro.rig.twin import CompiledTwin, Twin, VirtualClock
from macromicro.schema.text import printable
from macromicro.serve import faults, pacing
from macromicro.serve.joint.settings import JointSettings
from macromicro.serve.link import Outbox, receive
from macromicro.serve.live import Live
from macromicro.serve.loop_spec import Spec
from macromicro.serve.machine import Guard, Machine
from macromicro.serve.persist import Evident, Kept
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import Shared
from macromicro.serve.stage.settings import StageSettings
from macromicro.serve.ticking import ORPHANED, Loop
from macromicro.serve.warming import warm
from macromicro.types import Sample

_PR_SET_PDEATHSIG = 1
_DEATH = signal.SIGUSR2


class Drivable(Protocol):
    """What is opened to be driven: the rig itself, and whether its own clock waits."""

    @property
    def rig(self) -> Any:
        """For a session."""

    @property
    def paced(self) -> bool:
        """Does its own clock wait?"""

    def witness(self, sample: Sample) -> Evident:
        """What confirms a position that was kept."""

    def machine(self) -> Machine:
        """What the loop drives."""

    def guarded(self, session: Session) -> Guard:
        """The rig under its guard."""

    def warm(self) -> None:
        """Everything that runs in a period, once."""


class Opened(NamedTuple):
    """A bench to drive: the rig itself, its guard, the table of its Hall sensor, whether its own
    clock waits, whether its counter counts on while nothing runs, the stages that it has, and what
    makes its machine from which settings."""

    rig: Any
    guard: guard.Guard
    table: calibration.Calibration
    paced: bool
    counted: bool
    settings: LiveSettings
    make: Callable[..., Machine]
    stages: tuple[str, ...] = STAGES

    def machine(self) -> Machine:
        """The live machine."""
        made = self.make(self.settings, self.table, self.stages)
        if getattr(self.rig, "own_gains", False) and isinstance(made, Live):
            made.own_gains = True
        return made

    def guarded(self, session: Session) -> CompiledGuarded:
        """The rig under its guard."""
        return CompiledGuarded(session, self.guard, self.settings.period)

    def warm(self) -> None:
        """Everything that runs in a period, once."""
        warm(self.machine, self.guard, self.settings)

    def witness(self, sample: Sample) -> Evident:
        """What confirms a position that was kept."""
        contraction = calibration.position(self.table, sample.hall)
        return Evident(self.counted, sample.laser - contraction)


def main() -> None:
    """Run the loop process; its arguments are the descriptors of socket, memory and lock."""
    ends, memory, _lock = (int(text) for text in sys.argv[1:4])
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end = socket.socket(fileno=ends)
    spec: Spec = receive(end)
    outbox = Outbox(end)
    shared = Shared(memory)
    try:
        opened = open_machine(spec)
        machine = opened.machine()
        opened.warm()
    except InputError as error:
        outbox.send(("refused", error.where, printable(error.value, 300), error.accepted))
        sys.exit(1)
    except MacromicroError as error:
        outbox.send(("failed", str(error)))
        sys.exit(1)
    except Exception:
        outbox.send(("failed", traceback.format_exc(limit=-3)))
        sys.exit(1)
    session = Session(opened.rig, spec.settings.period)
    status = drive(spec, opened, session, machine, shared, outbox)
    outbox.send(("left", session.unstopped))
    outbox.flush()
    outbox.end()
    sys.exit(status)


def open_machine(spec: Spec) -> Drivable:
    """The rig that `spec` names; nothing is switched on. Raises InputError."""
    settings = spec.settings
    if isinstance(settings, StageSettings):
        from macromicro.serve.stage.opening import opened

        return opened(spec)
    if isinstance(settings, JointSettings):
        from macromicro.serve.joint import opening as joint

        return joint.opened(spec)
    maker, _, function = spec.machine.partition(":")
    make = getattr(importlib.import_module(maker), function)
    if spec.rig == TWIN:
        rig = twin(settings, spec.seed, spec.kept)
        table = hall_table.of_bench(settings)
        return Opened(rig, guard.prepare(settings.guard, table), table, False, True, settings, make)
    fixture = open_rig(spec.rig, spec.seed)
    if fixture.kind != BENCH:
        found = f"a {fixture.kind}"
        raise InputError(f"--rig {fixture.name}", found, "a bench")
    stages = alone.stages(fixture.channels)
    if not stages:
        shown = ", ".join(fixture.channels) or "nothing"
        accepted = "a rig that measures encoder (macro-stage), hall (micro-stage) or both"
        raise InputError(f"--rig {fixture.name}, channels", shown, accepted)
    own = fixture.calibrated() if MICRO in stages else calibration.shipped()  # of no use
    rig = fixture.make(spec.seed)
    if hasattr(rig, "yielding"):  # homing takes a limit switch for the stop
        rig.yielding = True
    limits = guard.prepare(fixture.limits or settings.guard, own)
    paced = not isinstance(rig.clock, VirtualClock)
    return Opened(rig, limits, own, paced, fixture.counted, settings, make, stages)


def twin(settings: LiveSettings, seed: int, kept: Kept | str) -> Twin:
    """The virtual bench of these settings, compiled and called once; its carriage stands
    where it was left."""
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


def drive(
    spec: Spec,
    opened: Drivable,
    session: Session,
    machine: Machine,
    shared: Shared,
    outbox: Outbox,
) -> int:
    """Loop until ordered to end; returns the exit status. The rig is stopped on every way out;
    `session` knows whether its stop returned."""
    rig = opened.guarded(session)
    timed = bool(getattr(opened.rig, "timed", False))
    settings = spec.settings
    paced, serve, period = opened.paced, settings.serve, settings.period
    loop = Loop(rig, machine, shared, outbox, serve, period, paced, timed)
    _die_with(spec.parent, loop, spec.settings.serve.loop_timeout)
    privileges = pacing.prepare(spec.settings.serve)
    shared.ring[:] = 0.0  # every page is there before the first period
    gc.collect()
    gc.freeze()
    gc.disable()
    signal.signal(signal.SIGTERM, _interrupted)  # what comes behind leaving the rig, too
    try:
        with rig:
            outbox.send(("ready", privileges, tuple(session.channels)))
            try:
                known = spec.settings.kept_as(spec.rig)
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
        outbox.send(("trouble", faults.failed(code, text)))
        if not from_rig:
            traceback.print_exc()
        return 1
    if ending == ORPHANED:  # one that was only halted hears of it once it goes on
        allowed = spec.settings.serve.parent_timeout
        outbox.send(("ended", faults.silent(loop.silence, allowed)))
    return 0


def _interrupted(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _inside_rig(error: Exception) -> bool:
    """Did the rig, or what it calls, raise it? (A session is between the loop and any rig.)"""
    names = [frame.f_code.co_filename for frame, _ in traceback.walk_tb(error.__traceback__)]
    return any(name.endswith(os.path.join("rig", "session.py")) for name in names)


def _die_with(parent: int, loop: Loop, patience: float) -> None:
    """Let the kernel tell when the serving process dies.

    It reports the death of the thread that started this process, which may be another
    one; so only a changed parent counts. A loop that has not left within `patience` [s] of it
    is interrupted.
    """

    def dying(number: int, frame: FrameType | None) -> None:
        if os.getppid() != parent:
            orphaned()

    def orphaned() -> None:
        loop.orphaned = True
        # A rig that blocks just now would never let the loop see that.
        signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGTERM))
        signal.setitimer(signal.ITIMER_REAL, patience)

    signal.signal(_DEATH, dying)
    with contextlib.suppress(OSError, AttributeError):  # without it the heartbeat shows it, later
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(_DEATH), 0, 0, 0)
    if os.getppid() != parent:
        orphaned()
