"""Faults beyond the guard's: missed periods, the loop process, the rig, the live machine."""

from __future__ import annotations

from collections.abc import Sequence

from macromicro.control.live.parameters import Live
from macromicro.machines import guarding
from macromicro.machines.stage_trees import all_of
from macromicro.place import LENGTH, Place
from macromicro.rig import codes, faults, guard
from macromicro.rig.faults import SWITCHED_OFF
from macromicro.serve.shared import Status
from macromicro.serve.snapshot import Trouble

Axes = Sequence[tuple[str, Live]]
STAGE = 200  # codes of a machine of one stage: its guard's, and so much
AXIS = 300  # the same of the first of several stages, and a hundred more of each further one
LATE, RIG_FAILED, CONTROL_FAILED, LOOP_DIED, LOST_COUNTS, LOOP_SILENT = range(100, 106)
_NAMES = {
    LATE: "control periods missed",
    RIG_FAILED: "rig failed",
    CONTROL_FAILED: "controller failed",
    LOOP_DIED: "loop process ended",
    LOST_COUNTS: "laser and encoder disagree",
    LOOP_SILENT: "loop silent",
}


def late(share: float, limit: float, time: float) -> Trouble:
    return Trouble(
        LATE,
        _NAMES[LATE],
        "Too many control periods were missed.",
        f"{share:.1%} of the last periods missed, allowed {limit:.1%}, at {time:.3f} s; "
        f"{SWITCHED_OFF}",
        "Close other programs, give the loop a core and real-time priority (`macromicro doctor "
        "--seconds 10` measures it); serve.miss_share and serve.miss_window set the limit.",
    )


def lost_counts(by_laser: float, by_encoder: float, time: float) -> Trouble:
    """The carriage's position by laser and by encoder [counts] differ."""
    return Trouble(
        LOST_COUNTS,
        _NAMES[LOST_COUNTS],
        "The laser and the encoder disagree: counts were lost, or the laser was disturbed.",
        f"the carriage is at {by_laser:.1f} counts by the laser and at {by_encoder:.0f} by the "
        f"encoder, at {time:.3f} s; {SWITCHED_OFF}",
        "Check the encoder's strip and cable and the laser's beam, then clear and home; "
        "live.edges.lost and live.edges.span set the limit, live.edges.use = 0 ignores the laser, "
        "and live.pitch must be the strip's.",
    )


def silent(seconds: float, allowed: float) -> str:
    """The loop's connection to its server is silent."""
    return (
        f"the server was silent for {seconds:.1f} s, allowed {allowed:g} s "
        "(serve.parent_timeout): it was halted, or the computer slept or was overloaded"
    )


_SUPPLY = "Check that the machine has stopped and cools down; if not, switch its supply off."


def failed(code: int, evidence: str) -> Trouble:
    message, remedy = {
        RIG_FAILED: (
            "The rig could not be read or written.",
            f"{_SUPPLY} Check its connection: the server opens the rig again by itself once it "
            "answers. Then home.",
        ),
        CONTROL_FAILED: (
            "The controller ended with an error.",
            "Its traceback is in the server's log. Fix the law if it is your own, else please "
            "report this text; then start again.",
        ),
        LOOP_DIED: (
            "The loop process has ended; nothing drives the machine.",
            f"{_SUPPLY} Then end the server, start it again and home.",
        ),
        LOOP_SILENT: (
            "The rig blocks: no control period came for too long.",
            f"{_SUPPLY} Check the rig's connection, then end the server, start it again and "
            "home; serve.loop_timeout sets the limit.",
        ),
    }[code]
    return Trouble(code, _NAMES[code], message, evidence, remedy)


def of_stage(
    code: float, value: float, limit: float, time: float, place: Place = LENGTH
) -> Trouble:
    """A fault of the guard of a single-stage machine, whose codes begin at `STAGE`."""
    watch = guarding.fresh()._replace(fault=int(code) - STAGE, value=value, limit=limit, time=time)
    found = guarding.describe(watch, place)
    assert found is not None
    return Trouble(int(code), found.name, found.message, found.evidence, found.remedy)


def of_axis(code: float, value: float, limit: float, time: float, axes: Axes) -> Trouble:
    """A fault of the guard of one of several stages, whose codes begin at `AXIS`."""
    k, own = divmod(int(code) - AXIS, 100)
    name, live = axes[k]
    found = of_stage(STAGE + own, value, limit, time, live.place)
    evidence = found.evidence.replace(SWITCHED_OFF, f"{all_of(len(axes))}: {SWITCHED_OFF}")
    message = f"Axis {name}: {found.message}"
    return Trouble(int(code), f"{name}: {found.name}", message, evidence, found.remedy)


def trouble(status: Status, place: Place = LENGTH, axes: Axes = ()) -> Trouble | None:
    """The latched fault in the loop's status, or None."""
    code = int(status.fault)
    if code == codes.OK:
        return None
    if code > AXIS:
        return of_axis(status.fault, status.value, status.limit, status.time, axes)
    if code > STAGE:
        return of_stage(status.fault, status.value, status.limit, status.time, place)
    if code == LATE:
        return late(status.value, status.limit, status.time)
    if code == LOST_COUNTS:
        return lost_counts(status.value, status.limit, status.time)
    watch = guard.fresh()._replace(
        fault=code, value=status.value, limit=status.limit, time=status.time
    )
    fault = faults.describe(watch)
    assert fault is not None
    return Trouble(fault.code, fault.name, fault.message, fault.evidence, fault.remedy)
