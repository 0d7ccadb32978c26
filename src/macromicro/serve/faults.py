"""Faults beyond the guard's: missed periods, the loop process, the rig, the live machine."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

from macromicro.control.live.parameters import Live
from macromicro.machines import guarding
from macromicro.machines.stage_trees import all_of
from macromicro.place import LENGTH, Place
from macromicro.rig import codes, faults
from macromicro.rig.faults import SWITCHED_OFF, Text
from macromicro.serve.shared import Status
from macromicro.serve.snapshot import Trouble

Axes = Sequence[tuple[str, Live]]
STAGE = 200  # codes of a machine of one stage: its guard's, and so much
AXIS = 300  # the same of the first of several stages, and a hundred more of each further one
LATE, RIG_FAILED, CONTROL_FAILED, LOOP_DIED, LOST_COUNTS, LOOP_SILENT = range(100, 106)
_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
_TEXTS = {int(code): Text(**row) for code, row in _TABLE.items()} | faults.TEXTS


def silent(seconds: float, allowed: float) -> str:
    """The loop's connection to its server is silent."""
    return (
        f"the server was silent for {seconds:.1f} s, allowed {allowed:g} s "
        "(serve.parent_timeout): it was halted, or the computer slept or was overloaded"
    )


def failure(code: int, evidence: str) -> Trouble:
    """A fault that ended the loop."""
    text = _TEXTS[code]
    return Trouble(code, text.name, text.message, evidence, text.remedy)


def describe(
    code: float,
    value: float,
    limit: float,
    time: float,
    place: Place = LENGTH,
    axes: Axes = (),
) -> Trouble:
    """A fault that the loop goes on with, by its code, its value and limit, and its time."""
    number = int(code)
    if number > AXIS:
        return _of_axis(number, value, limit, time, axes)
    if number > STAGE:
        return _of_stage(number, value, limit, time, place)
    text = _TEXTS[number]
    evidence = f"{text.seen(value, limit)}, at {time:.3f} s; {SWITCHED_OFF}"
    return Trouble(number, text.name, text.message, evidence, text.remedy)


def _of_stage(code: int, value: float, limit: float, time: float, place: Place) -> Trouble:
    """A fault of the guard of a single-stage machine, whose codes begin at `STAGE`."""
    watch = guarding.fresh()._replace(fault=code - STAGE, value=value, limit=limit, time=time)
    found = guarding.describe(watch, place)
    assert found is not None
    return Trouble(code, found.name, found.message, found.evidence, found.remedy)


def _of_axis(code: int, value: float, limit: float, time: float, axes: Axes) -> Trouble:
    """A fault of the guard of one of several stages, whose codes begin at `AXIS`."""
    k, own = divmod(code - AXIS, 100)
    name, live = axes[k]
    found = _of_stage(STAGE + own, value, limit, time, live.place)
    evidence = found.evidence.replace(SWITCHED_OFF, f"{all_of(len(axes))}: {SWITCHED_OFF}")
    message = f"Axis {name}: {found.message}"
    return Trouble(code, f"{name}: {found.name}", message, evidence, found.remedy)


def trouble(status: Status, place: Place = LENGTH, axes: Axes = ()) -> Trouble | None:
    """The latched fault in the loop's status, or None."""
    if status.fault == codes.OK:
        return None
    return describe(status.fault, status.value, status.limit, status.time, place, axes)
