"""Faults that the guard does not know: of the loop's time, of the loop, of the rig."""

from __future__ import annotations

from macromicro.rig import faults, guard
from macromicro.serve.shared import Status
from macromicro.serve.snapshot import Trouble

LATE, RIG_FAILED, CONTROL_FAILED, LOOP_DIED = range(100, 104)
_NAMES = {
    LATE: "control periods missed",
    RIG_FAILED: "rig failed",
    CONTROL_FAILED: "controller failed",
    LOOP_DIED: "loop process ended",
}


def late(share: float, limit: float, time: float) -> Trouble:
    """Too many periods were missed."""
    return Trouble(
        LATE,
        _NAMES[LATE],
        "The machine computes too slowly: too many control periods were missed.",
        f"{share:.1%} of the last periods missed, allowed {limit:.1%}, at {time:.3f} s; all "
        "outputs are safe",
        "Close what else is computing, give the loop a core and real-time priority "
        "(`macromicro doctor`), see `macromicro latency`; serve.miss_share and "
        "serve.miss_window set what is allowed.",
    )


def failed(code: int, evidence: str) -> Trouble:
    """The rig or the controller raised an error, or the loop process is gone."""
    message, remedy = {
        RIG_FAILED: (
            "The rig could not be read or written.",
            "Check its supply and its connection, then start again.",
        ),
        CONTROL_FAILED: (
            "The controller ended with an error.",
            "Start again; please report it with this text.",
        ),
        LOOP_DIED: (
            "The loop process has ended; nothing drives the machine.",
            "See that the machine stands, then start again; its position is to be homed.",
        ),
    }[code]
    return Trouble(code, _NAMES[code], message, evidence, remedy)


def trouble(status: Status) -> Trouble | None:
    """The latched fault that the loop's status tells; None if all is well."""
    code = int(status.fault)
    if code == guard.OK:
        return None
    if code == LATE:
        return late(status.value, status.limit, status.time)
    watch = guard.fresh()._replace(
        fault=code, value=status.value, limit=status.limit, time=status.time
    )
    fault = faults.describe(watch)
    assert fault is not None
    return Trouble(fault.code, fault.name, fault.message, fault.evidence, fault.remedy)
