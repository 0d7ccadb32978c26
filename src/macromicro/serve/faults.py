"""Faults beyond the guard's: missed periods, the loop process, the rig, the live machine."""

from __future__ import annotations

from collections.abc import Sequence

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
_TEXTS = {
    LATE: Text(
        "control periods missed",
        "Too many control periods were missed.",
        "{value:.1%} of the last periods missed, allowed {limit:.1%}",
        "Close other programs, give the loop a core and real-time priority (`macromicro doctor "
        "--seconds 10` measures it); serve.miss_share and serve.miss_window set the limit.",
    ),
    LOST_COUNTS: Text(
        "laser and encoder disagree",
        "The laser and the encoder disagree: counts were lost, or the laser was disturbed.",
        "the carriage is at {value:.1f} counts by the laser and at {limit:.0f} by the encoder",
        "Check the encoder's strip and cable and the laser's beam, then clear and home; "
        "live.edges.lost and live.edges.span set the limit, live.edges.use = 0 ignores the laser, "
        "and live.pitch must be the strip's.",
    ),
    **faults.TEXTS,
}
_SUPPLY = "Check that the machine has stopped and cools down; if not, switch its supply off."
_ENDED = {
    RIG_FAILED: (
        "rig failed",
        "The rig could not be read or written.",
        f"{_SUPPLY} Check its connection: the server opens the rig again by itself once it "
        "answers. Then home.",
    ),
    CONTROL_FAILED: (
        "controller failed",
        "The controller ended with an error.",
        "Its traceback is in the server's log. Fix the law if it is your own, else please "
        "report this text; then start again.",
    ),
    LOOP_DIED: (
        "loop process ended",
        "The loop process has ended; nothing drives the machine.",
        f"{_SUPPLY} Then end the server, start it again and home.",
    ),
    LOOP_SILENT: (
        "loop silent",
        "The rig blocks: no control period came for too long.",
        f"{_SUPPLY} Check the rig's connection, then end the server, start it again and "
        "home; serve.loop_timeout sets the limit.",
    ),
}


def silent(seconds: float, allowed: float) -> str:
    """The loop's connection to its server is silent."""
    return (
        f"the server was silent for {seconds:.1f} s, allowed {allowed:g} s "
        "(serve.parent_timeout): it was halted, or the computer slept or was overloaded"
    )


def failed(code: int, evidence: str) -> Trouble:
    """A fault that ended the loop."""
    name, message, remedy = _ENDED[code]
    return Trouble(code, name, message, evidence, remedy)


def described(
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
    return described(status.fault, status.value, status.limit, status.time, place, axes)
