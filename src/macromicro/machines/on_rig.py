"""A single-stage machine on a user's rig: checks, and the way to the start."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.machines import board_limits, planning, runs
from macromicro.machines.machine import Machine
from macromicro.machines.runs import Blocks, Outcome
from macromicro.machines.sequence import Plan
from macromicro.motion import s_curve
from macromicro.place import of as place_of
from macromicro.recorder import Behind
from macromicro.rig.board import named as boards
from macromicro.rig.board.rig import BOARD_LOOP
from macromicro.rig.opening import OPTION, TWIN, open_rig
from macromicro.rig.replay import SCHEME
from macromicro.rig.session import BENCH, Fixture, Session
from macromicro.simulate import Sink

Ended = TypeVar("Ended")

_SHARE = 0.25  # of the greatest speed, on the way to the start


def found(name: str, settings: Any, seed: int, what: str = "a programme") -> Fixture | None:
    if name == TWIN:
        return None
    if name.startswith(SCHEME):
        raise ProblemError(OPTION, "only the two-stage machine can replay a recording")
    if boards.is_board(name) and boards.read(name).loop == BOARD_LOOP:
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
    return planning.joined([way], float("nan"), place)


class Standing(NamedTuple):
    """A stage on a rig before a run."""

    machine: Machine  # the machine, or an axis of one of several
    settings: Any
    plan: Plan  # its part of the programme
    rig: Any  # that can be left idle: a `Session`, or half of a `Pair`; not entered
    rest: float = 0.0  # how long it is left switched off first, s


def from_start(stages: Sequence[Standing], sink: Sink, run: Callable[[Sink], Ended]) -> Ended:
    """Bring stages to the start of a programme and run it; outputs are safe however it ends."""
    with contextlib.ExitStack() as left:
        for one in stages:
            left.enter_context(one.rig)
        for one in stages:
            one.rig.idle(one.rest)
        for one in stages:
            bring(one.machine, one.settings, one.plan, one.rig)
        with Behind(sink, runs.CHUNK) as behind:
            return run(behind)


def perform(
    machine: Machine,
    settings: Any,
    plan: Plan,
    sink: Sink,
    rig: Session,
    rest: float = 0.0,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan on a rig, from wherever it stands."""

    def run(behind: Sink) -> Outcome:
        return runs.perform(machine, settings, plan, behind, on=rig, progress=progress)

    return from_start([Standing(machine, settings, plan, rig, rest)], sink, run)


def bring(machine: Machine, settings: Any, plan: Plan, rig: Any) -> None:
    """Go to where a plan begins, unless it stands there."""
    place = float(rig.read().encoder) * float(settings.encoder.pitch)
    if abs(place - plan.origin) <= settings.arrival.tolerance:
        return
    way = _from(place, plan, settings)
    blocks, unit = Blocks(), place_of(settings)
    outcome = runs.perform(machine, settings, way, blocks, on=rig)
    where = f"the way to {unit.told(way.target[0])}, where the programme begins"
    if outcome.fault is not None:
        fault = outcome.fault
        raise MacromicroError(f"{where}: {fault.message} {fault.evidence}. {fault.remedy}")
    rows = [c.name for c in runs.columns(machine, rig)]
    last = float(blocks.blocks[-1][rows.index("position"), -1]) / unit.per
    if not abs(last - way.target[0]) <= settings.arrival.tolerance:
        raise MacromicroError(f"{where}: the stage stopped at {unit.told(last)}")


def said(
    machine: Machine, settings: Any, plan: Plan, title: str, name: str, expected: float
) -> list[str]:
    """What a run will move, how far and how hard."""
    unit = place_of(settings)
    hard = f"up to {settings.guard.effort:g} V"
    low, high = float(np.min(plan.target)), float(np.max(plan.target))
    fast = unit.told(_SHARE * settings.motion.velocity, "m/s", 4)
    return [
        f"{name}, {title or 'a programme'}, about {expected:.0f} s:",
        f"  first to {unit.told(plan.origin)} by its encoder, at up to {fast}",
        f"  {machine.kind.name}: {len(plan.target)} set points from {unit.told(low)} to "
        f"{unit.told(high)}, {hard}",
    ]
