"""Both axes of a machine on two rigs of the user's: whether they can be, the way to their start."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from macromicro.errors import InputError
from macromicro.machines import on_rig
from macromicro.machines.joint.machine import XY_MACHINE, Joint
from macromicro.machines.joint.on_rig import Pair, driven
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.runs import Outcome
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.runs import Blocks
from macromicro.rig.opening import OPTION, TWIN
from macromicro.rig.session import Fixture
from macromicro.schema.text import printable
from macromicro.simulate import Sink

AND = "+"  # between the names of two rigs
ACCEPTED = f"{TWIN}, or the rigs of both axes, x first: mylab:x{AND}mylab:y"
Two = tuple[Fixture, Fixture]


def found(name: str, settings: Any, seed: int, what: str = "a programme") -> Two | None:
    """The rigs that ``--rig`` names.

    Parameters
    ----------
    name : str
        "twin", or two names as a machine of one stage takes them, "+" between.
    settings : Any
        Of the machine.
    seed : int
        Given to the factories; the second gets the next one.
    what : str, optional
        What is wanted of them, for messages.

    Returns
    -------
    tuple[Fixture, Fixture] | None
        None: the simulated machine.

    Raises
    ------
    InputError
        They are not two, or one of them is not to be had.
    """
    if name == TWIN:
        return None
    made = [
        on_rig.found(one, own, seed + k, what)
        for k, (one, own) in enumerate(zip(named(name), of(settings), strict=True))
    ]
    first, second = (one for one in made if one is not None)
    return first, second


def several(name: str) -> bool:
    """Whether a name is that of more than one rig.

    Parameters
    ----------
    name : str
        As of ``--rig``.

    Returns
    -------
    bool
        False for a file that has a "+" in its name.
    """
    return AND in name and not Path(name).is_file()


def named(name: str) -> list[str]:
    """The rig of each axis.

    Parameters
    ----------
    name : str
        As of ``--rig``: two names, "+" between.

    Returns
    -------
    list[str]
        x first.

    Raises
    ------
    InputError
        They are not two, or one of them is the twin.
    """
    names = [one.strip() for one in name.split(AND)]
    if len(names) != len(AXES) or TWIN in names:
        raise InputError(OPTION, printable(name), ACCEPTED)
    return names


def opened(rigs: Two, seed: int) -> Pair:
    """Both rigs on one clock, to be entered for one run.

    Parameters
    ----------
    rigs : tuple[Fixture, Fixture]
        From `found`.
    seed : int
        Given to the factories.

    Returns
    -------
    Pair
        Of sessions.
    """
    return Pair([rig.open(seed + k) for k, rig in enumerate(rigs)])


def perform(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    sink: Sink,
    pair: Pair,
    rests: tuple[float, float] = (0.0, 0.0),
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan on two rigs, from wherever they stand.

    Each is brought to where the plan begins, one after the other, under its own law and guard; then
    both are driven in step. The sink has everything at the end, as of `on_rig.from_start`.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.
    plan : JointPlan
        The programme.
    sink : Sink
        As for `runs.perform`.
    pair : Pair
        From `opened`.
    rests : tuple[float, float], optional
        How long each is left switched off first, s.
    progress : Callable[[float, int], None] | None, optional
        As for `runs.perform`.

    Returns
    -------
    Outcome
        How it ended.

    Raises
    ------
    MacromicroError
        An axis did not come to its start.
    """
    halves = (pair.halves[0], pair.halves[1])
    each = zip(machine.axes, of(settings), plan.plans, halves, rests, strict=True)

    def run(blocks: Blocks) -> Outcome:
        pair.together = True
        return driven(machine, settings, plan, halves, blocks, progress)

    return on_rig.from_start([on_rig.Standing(*one) for one in each], sink, run)


def said(settings: Any, plan: JointPlan, title: str, rigs: Two, expected: float) -> list[str]:
    """What a run on two rigs will move, how far and how hard.

    Parameters
    ----------
    settings : Any
        Of the machine.
    plan : JointPlan
        The programme.
    title : str
        Of it.
    rigs : tuple[Fixture, Fixture]
        From `found`.
    expected : float
        Usual duration, s.

    Returns
    -------
    list[str]
        Lines.
    """
    lines = [f"{title or 'a programme'}, about {expected:.0f} s, both axes in step:"]
    for name, own, each, rig in zip(AXES, of(settings), plan.plans, rigs, strict=True):
        told = on_rig.said(XY_MACHINE.axes[0], own, each, "", f"{name} on {rig.name}", expected)
        lines += ["  " + line for line in told]
    return lines
