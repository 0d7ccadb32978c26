"""A machine on its user's rigs: checks, and the way to the start."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.machines import board_limits, composite, performing, planning
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.joint.settings import AXES
from macromicro.machines.machine import Machine
from macromicro.machines.planning import Planned
from macromicro.machines.sequence import Plan
from macromicro.machines.stage_trees import all_of
from macromicro.motion import s_curve
from macromicro.place import of as place_of
from macromicro.recorder import Behind
from macromicro.rig.board import named as boards
from macromicro.rig.board.rig import BOARD_LOOP
from macromicro.rig.opening import OPTION, TWIN, open_rig
from macromicro.rig.replay import SCHEME
from macromicro.rig.session import BENCH, Fixture
from macromicro.runs.setup import Blocks, Progress
from macromicro.schema.text import printable
from macromicro.simulate import Outcome, Sink
from macromicro.types import Outputs

AND = "+"  # between the names of rigs
_SHARE = 0.25  # of the greatest speed, on the way to the start


def find_rigs(
    name: str, machine: AnyMachine, settings: Any, seed: int, what: str = "a programme"
) -> tuple[Fixture, ...] | None:
    """The rigs of a machine, one a stage; None: the simulated machine."""
    if name == TWIN:
        return None
    trees = machine.trees(settings)
    names = rig_names(name, composite.names(machine)) if isinstance(machine, Composite) else [name]
    each = enumerate(zip(names, trees, strict=True))
    return tuple(one(rig, own, seed + k, what) for k, (rig, own) in each)


def several(name: str) -> bool:
    """Whether it names the rigs of several stages."""
    return AND in name and not Path(name).is_file()


def rig_names(name: str, stages: tuple[str, ...] = AXES) -> list[str]:
    """The rig of each stage."""
    names = [one.strip() for one in name.split(AND)]
    if len(names) != len(stages) or TWIN in names:
        rigs = AND.join(f"mylab:{stage}" for stage in stages)
        accepted = f"{TWIN}, or the rigs of {all_of(len(stages))}, {stages[0]} first: {rigs}"
        raise InputError(OPTION, printable(name), accepted)
    return names


def one(name: str, settings: Any, seed: int, what: str = "a programme") -> Fixture:
    """The rig of one stage."""
    if name.startswith(SCHEME):
        raise ProblemError(OPTION, "only the two-stage machine can replay a recording")
    if boards.is_board(name) and boards.parse(name).loop == BOARD_LOOP:
        problem = "the law of this machine runs on the host"
        raise ProblemError(f"--loop {BOARD_LOOP}", problem, "Use --loop host or leave it out.")
    limits = board_limits.of(settings) if boards.is_board(name) else None
    fixture = open_rig(name, seed, alone=True, limits=limits)
    where = f"{OPTION} {fixture.name}"
    if fixture.kind != BENCH:
        raise ProblemError(where, f"the rig is a {fixture.kind}", f"Use a bench for {what}.")
    fixture.need(what, "encoder")
    in_step(settings, fixture)
    return fixture


def in_step(settings: Any, fixture: Fixture) -> None:
    period = float(settings.timing.period)
    if abs(period - fixture.dt) > 1e-9:
        accepted = f"{fixture.dt:g} s, the period of {fixture.name}"
        raise InputError("timing.period", f"{period:g} s", accepted)


def _from(place: float, plan: Plan, settings: Any) -> Plan:
    most, distance = settings.motion, plan.origin - place
    speed = _SHARE * most.velocity
    profile = s_curve(distance, speed, most.acceleration, most.jerk, start=place)
    pieces = np.array(profile.segments).reshape(-1, 5)
    way = planning.Way(float("nan"), plan.origin, 0.0, pieces)
    return planning.join([way], float("nan"), place)


class Rigs:
    """Several rigs on one clock: in step, or one moving while the others keep their efforts.

    Each stays switched off for its rest (s) before a run.
    """

    def __init__(self, rigs: Sequence[Any], rests: Sequence[float] = ()) -> None:
        self.rigs, self.rests = tuple(rigs), rests or [0.0] * len(rigs)
        self.together = False
        self.members = tuple(Member(self, k) for k in range(len(self.rigs)))

    def wait(self, dt: float) -> None:
        for rig in self.rigs:
            rig.clock.wait(dt)


class Member:
    """One of several rigs on one clock, as a `Rig`."""

    def __init__(self, group: Rigs, k: int) -> None:
        self._group, self._rig, self._last = group, group.rigs[k], k == len(group.rigs) - 1
        self.channels = tuple(self._rig.channels)
        self.outputs = tuple(getattr(self._rig, "outputs", ()))
        self.clock = self

    def now(self) -> float:
        return float(self._rig.clock.now())

    def wait(self, dt: float) -> None:
        """Wait for the next period; in step, only the last one waits."""
        if self._last or not self._group.together:
            self._group.wait(dt)

    def read(self) -> Any:
        return self._rig.read()

    def write(self, outputs: Outputs) -> None:
        self._rig.write(outputs)

    def idle(self, seconds: float) -> None:
        """Let time pass with safe outputs."""
        self._rig.idle(seconds)

    def stop(self) -> None:
        self._rig.stop()

    def __enter__(self) -> Self:
        self._rig.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._rig.__exit__(kind, error, trace)


def open_rigs(rigs: Sequence[Fixture], seed: int) -> Rigs:
    """Rigs on one clock, for one run."""
    each = [rig.open(seed + k) for k, rig in enumerate(rigs)]
    return Rigs(each, [rig.rest for rig in rigs])


def perform(
    machine: AnyMachine,
    settings: Any,
    planned: Planned,
    sink: Sink,
    rigs: Rigs,
    progress: Progress | None = None,
) -> Outcome:
    """Run a plan on rigs, from wherever they stand; outputs are safe however it ends.

    Each goes to the start of its plan, then all run in step.
    """
    trees, plans = machine.trees(settings), planning.each(planned)
    with contextlib.ExitStack() as left:
        for rig in rigs.members:
            left.enter_context(rig)
        for rig, rest in zip(rigs.members, rigs.rests, strict=True):
            rig.idle(rest)
        for (_, stage), *each in zip(machine.stages, trees, plans, rigs.members, strict=True):
            bring(stage, *each)
        rigs.together = True
        with Behind(sink, performing.CHUNK) as behind:
            how: Any = {"on": rigs.members, "progress": progress}
            return performing.perform(machine, settings, planned, behind, **how)


def bring(machine: Machine, settings: Any, plan: Plan, rig: Any) -> None:
    """Go to where a plan begins, unless it stands there."""
    place = float(rig.read().encoder) * float(settings.encoder.pitch)
    if abs(place - plan.origin) <= settings.arrival.tolerance:
        return
    way = _from(place, plan, settings)
    blocks, unit = Blocks(), place_of(settings)
    outcome = performing.perform(machine, settings, way, blocks, on=rig)
    where = f"the way to {unit.told(way.target[0])}, where the programme begins"
    if outcome.fault is not None:
        raise MacromicroError(f"{where}: {outcome.fault.text}")
    rows = [c.name for c in performing.columns(machine, rig)]
    last = float(blocks.blocks[-1][rows.index("position"), -1]) / unit.per
    if not abs(last - way.target[0]) <= settings.arrival.tolerance:
        raise MacromicroError(f"{where}: the stage stopped at {unit.told(last)}")


def announce(
    machine: AnyMachine,
    settings: Any,
    planned: Planned,
    title: str,
    rigs: Sequence[Fixture],
    expected: float,
) -> list[str]:
    """What a run will move, how far and how hard."""
    whole = f"{title or 'a programme'}, about {expected:.0f} s"
    trees, plans = machine.trees(settings), planning.each(planned)
    each = zip(composite.names(machine), machine.stages, trees, plans, rigs, strict=True)
    if not isinstance(machine, Composite):
        return [f"{rigs[0].name}, {whole}:", *_announce_stage(machine, settings, plans[0])]
    lines = [f"{whole}, {all_of(len(rigs))} in step:"]
    for name, (_, one), own, plan, rig in each:
        lines += [
            f"  {name} on {rig.name}:",
            *("  " + line for line in _announce_stage(one, own, plan)),
        ]
    return lines


def _announce_stage(machine: Machine, settings: Any, plan: Plan) -> list[str]:
    unit = place_of(settings)
    hard = f"up to {settings.guard.effort:g} V"
    low, high = float(np.min(plan.target)), float(np.max(plan.target))
    fast = unit.told(_SHARE * settings.motion.velocity, "m/s", 4)
    return [
        f"  first to {unit.told(plan.origin)} by its encoder, at up to {fast}",
        f"  {machine.kind.name}: {len(plan.target)} set points from {unit.told(low)} to "
        f"{unit.told(high)}, {hard}",
    ]
