"""Before a rig of the user's moves: what will, how far and how hard, and whether it may."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.errors import InputError
from macromicro.programme import MACRO, MICRO
from macromicro.rig.session import Fixture
from macromicro.runs.job import Job

OPTION = "--yes"


def stepwise(rig: str, *, yes: bool) -> Callable[[str, str], None]:
    """Asks before each step of a procedure.

    Parameters
    ----------
    rig : str
        As of ``--rig``.
    yes : bool
        Nothing is asked.

    Returns
    -------
    Callable[[str, str], None]
        Takes the step's title and what it will do; raises what `agreed` does.
    """
    return lambda title, intent: agreed([f"{title}: {intent}"], f"--rig {rig}", yes=yes)


def agreed(lines: list[str], where: str, *, yes: bool) -> None:
    """Say what is about to move; ask, unless `yes`.

    Parameters
    ----------
    lines : list[str]
        What will move, how far and how hard.
    where : str
        The option that named it, for messages.
    yes : bool
        Whether the person agreed beforehand.

    Raises
    ------
    InputError
        Nobody has agreed.
    """
    print(*lines, sep="\n", file=sys.stderr, flush=True)
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError(where, "it would move, and nobody can be asked", OPTION)
    print("move it? [y/N] ", end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise InputError(where, "not agreed to", f"y, or {OPTION}")


def before(job: Job, yes: bool) -> None:
    """Say what a run on a rig will do; ask, unless `yes`.

    Raises
    ------
    InputError
        Nobody has agreed.
    """
    if isinstance(job.source, Fixture):
        agreed(said(job, job.source), f"--rig {job.source.name}", yes=yes)


def before_one(job: Any, yes: bool) -> None:
    """The same of a run of a machine of one stage, or of two axes.

    Raises
    ------
    InputError
        Nobody has agreed.
    """
    from macromicro.machines import on_rig
    from macromicro.machines.joint import two_rigs

    source = getattr(job, "source", None)
    if source is None:
        return
    about = (job.settings, job.plan, job.programme.title)
    if isinstance(source, Fixture):
        lines = on_rig.said(job.machine, *about, source.name, job.expected)
    else:
        lines = two_rigs.said(*about, source, job.expected)
    agreed(lines, f"--rig {job.request.rig}", yes=yes)


def said(job: Job, rig: Fixture) -> list[str]:
    """What will move, how far and how hard."""
    control, pitch = job.settings.controller, job.settings.sensors.encoder.pitch
    stage, target = job.programme.stage, job.programme.target
    lines = [f"{rig.name}, {job.programme.title or 'a programme'}, about {job.expected:.0f} s:"]
    if rig.has("encoder"):
        lines.append(f"  first the macro-stage to 0 counts, at up to {control.motor_limit:g} V")
    for which, name, scale, limit in (
        (MACRO, "macro", 1e3 * pitch, f"motor up to {control.motor_limit:g} V"),
        (MICRO, "micro", 1e3, f"CTRL up to {control.ctrl_limit:g} V"),
    ):
        ways = target[stage == which] * scale
        if len(ways):
            reach = f"from {np.min(ways):.6g} to {np.max(ways):.6g} mm"
            lines.append(f"  {name}-stage: {len(ways)} set points {reach}, {limit}")
    return lines
