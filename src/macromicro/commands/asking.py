"""Confirmation before a rig of the user's moves."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.errors import ProblemError
from macromicro.programme import MACRO, MICRO
from macromicro.rig.session import Fixture
from macromicro.runs.job import Job

OPTION = "--yes"


def stepwise(rig: str, *, yes: bool) -> Callable[[str, str], None]:
    """Ask before each step of a procedure."""
    return lambda title, intent: agreed([f"{title}: {intent}"], f"--rig {rig}", yes=yes)


def agreed(lines: list[str], where: str, *, yes: bool) -> None:
    """Say what is about to move and ask for confirmation, unless `yes`."""
    print(*lines, sep="\n", file=sys.stderr, flush=True)
    if yes:
        return
    if not sys.stdin.isatty():
        raise ProblemError(
            where, "confirmation needed, but standard input is not a terminal", f"Add {OPTION}."
        )
    print("move it? [y/N] ", end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise ProblemError(where, "not confirmed", f"Answer y, or add {OPTION}.")


def before(job: Job, yes: bool) -> None:
    if isinstance(job.source, Fixture):
        agreed(said(job, job.source), f"--rig {job.source.name}", yes=yes)


def before_one(job: Any, yes: bool) -> None:
    """Ask before a run of a machine of one stage or of several, unless `yes`."""
    from macromicro.machines import on_rig

    if job.source is None:
        return
    what = (job.machine, job.settings, job.plan, job.programme.title)
    agreed(on_rig.said(*what, job.source, job.expected), f"--rig {job.request.rig}", yes=yes)


def said(job: Job, rig: Fixture) -> list[str]:
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
