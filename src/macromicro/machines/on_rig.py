"""A machine of one stage on a rig of the user's: whether it can be, and the way to its start."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, MacromicroError
from macromicro.machines import planning, runs
from macromicro.machines.machine import Machine
from macromicro.machines.runs import Blocks, Outcome
from macromicro.machines.sequence import Plan
from macromicro.motion import s_curve
from macromicro.place import of as place_of
from macromicro.rig.board import named as boards
from macromicro.rig.board.rig import BOARD_LOOP
from macromicro.rig.opening import OPTION, TWIN, open_rig
from macromicro.rig.replay import SCHEME
from macromicro.rig.session import BENCH, Fixture, Session
from macromicro.schema.text import printable
from macromicro.simulate import Sink

Ended = TypeVar("Ended")

_SHARE = 0.25  # of the greatest speed, on the way to the start


def found(name: str, settings: Any, seed: int, what: str = "a programme") -> Fixture | None:
    """The rig that ``--rig`` names, for a machine of one stage.

    Parameters
    ----------
    name : str
        "twin", "MODULE:FACTORY", "FILE.toml" or "board:PORT,loop=host".
    settings : Any
        Of the machine.
    seed : int
        Given to the factory.
    what : str, optional
        What is wanted of it, for messages.

    Returns
    -------
    Fixture | None
        None: the simulated machine.

    Raises
    ------
    InputError
        It is not to be had, measures no encoder, runs a law of its own, or keeps another period.
    """
    if name == TWIN:
        return None
    if name.startswith(SCHEME):
        raise InputError(OPTION, printable(name), "a replay only of the two-stage machine")
    if boards.is_board(name) and boards.read(name).loop == BOARD_LOOP:
        raise InputError(
            "--loop", BOARD_LOOP, "host, or no --loop: the law of this machine runs here"
        )
    fixture = open_rig(name, seed, alone=True)
    where = f"{OPTION} {fixture.name}"
    if fixture.kind != BENCH:
        raise InputError(where, f"a {fixture.kind}", f"a bench, for {what}")
    fixture.need(what, "encoder")
    in_step(settings, fixture)
    return fixture


def in_step(settings: Any, fixture: Fixture) -> None:
    """Whether a rig keeps the period of the machine's law.

    Parameters
    ----------
    settings : Any
        Of the machine.
    fixture : Fixture
        The rig.

    Raises
    ------
    InputError
        It keeps another one.
    """
    period = float(settings.timing.period)
    if abs(period - fixture.dt) > 1e-9:
        accepted = f"{fixture.dt:g} s, the period of {fixture.name}"
        raise InputError("timing.period", f"{period:g} s", accepted)


def _from(place: float, plan: Plan, settings: Any) -> Plan:
    """The way from a place to where a plan begins."""
    most, distance = settings.motion, plan.origin - place
    speed = _SHARE * most.velocity
    profile = s_curve(distance, speed, most.acceleration, most.jerk, start=place)
    pieces = np.array(profile.segments).reshape(-1, 5)
    way = planning.Way(float("nan"), plan.origin, 0.0, pieces)
    return planning.joined([way], float("nan"), place)


class Standing(NamedTuple):
    """A stage on a rig, wherever it stands before a run.

    Attributes
    ----------
    machine : Machine
        The machine, or an axis of one of several.
    settings : Any
        Its settings.
    plan : Plan
        Its part of the programme.
    rig : Any
        That can be left idle: a `Session`, or half of a `Pair`; not entered.
    rest : float
        How long it is left switched off first, s.
    """

    machine: Machine
    settings: Any
    plan: Plan
    rig: Any
    rest: float = 0.0


def from_start(stages: Sequence[Standing], sink: Sink, run: Callable[[Blocks], Ended]) -> Ended:
    """Bring stages to where a programme begins, and run it.

    Every rig is entered before anything moves, and left, its outputs safe, however this ends. Then
    each is left switched off, and each is brought to its start under its own law and guard, in the
    order given. The sink has everything at the end, however the run ends: a file that is written
    meanwhile would cost periods.

    Parameters
    ----------
    stages : Sequence[Standing]
        Of all axes.
    sink : Sink
        As for `runs.perform`.
    run : Callable[[Blocks], Ended]
        Runs the programme from its start into memory.

    Returns
    -------
    Ended
        What `run` gives.

    Raises
    ------
    MacromicroError
        One did not come to its start.
    """
    blocks = Blocks()
    with contextlib.ExitStack() as left:
        for one in stages:
            left.enter_context(one.rig)
        for one in stages:
            one.rig.idle(one.rest)
        for one in stages:
            bring(one.machine, one.settings, one.plan, one.rig)
        try:
            return run(blocks)
        finally:
            if blocks.blocks:
                _flush(blocks.blocks, sink)


def perform(
    machine: Machine,
    settings: Any,
    plan: Plan,
    sink: Sink,
    rig: Session,
    rest: float = 0.0,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan on a rig, from wherever it stands.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.
    plan : Plan
        The programme.
    sink : Sink
        As for `from_start`.
    rig : Session
        From `Fixture.open`; entered and left here.
    rest : float, optional
        How long it is left switched off first, s.
    progress : Callable[[float, int], None] | None, optional
        As for `runs.perform`.

    Returns
    -------
    Outcome
        How it ended.

    Raises
    ------
    MacromicroError
        It did not come to its start.
    """

    def run(blocks: Blocks) -> Outcome:
        return runs.perform(machine, settings, plan, blocks, on=rig, progress=progress)

    return from_start([Standing(machine, settings, plan, rig, rest)], sink, run)


def _flush(blocks: list[Array], sink: Sink) -> None:
    """Hand over what was kept in memory."""
    rows = np.concatenate(blocks, axis=1)
    for k in range(0, rows.shape[1], runs.CHUNK):
        sink.append(rows[:, k : k + runs.CHUNK])


def bring(machine: Machine, settings: Any, plan: Plan, rig: Any) -> None:
    """Go to where a plan begins, unless it stands there.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.
    plan : Plan
        The programme.
    rig : Any
        A rig that was entered.

    Raises
    ------
    MacromicroError
        It does not arrive.
    """
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
        raise MacromicroError(f"{where}: it came to {unit.told(last)}")


def said(
    machine: Machine, settings: Any, plan: Plan, title: str, name: str, expected: float
) -> list[str]:
    """What a run on a rig will move, how far and how hard.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.
    plan : Plan
        The programme.
    title : str
        Of it.
    name : str
        Of the rig.
    expected : float
        Usual duration, s.

    Returns
    -------
    list[str]
        Lines.
    """
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
