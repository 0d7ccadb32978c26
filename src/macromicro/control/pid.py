"""Benchmark PID (Section 4.3.1): no compensation of friction, no anti-windup."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.control.law import Law
from macromicro.kernel import kernel
from macromicro.schema.par import Par

# An error of one count at 5 V/count, or a change by one count in 1 ms at 5 mV*s/count, is the
# D/A's full scale: beyond that a law only switches. Twenty times as much is taken.
STEEPEST = 100.0  # V/count
SHARPEST = 0.1  # V*s/count
# One period of 1 ms adds as much as the steepest proportional gain gives.
QUICKEST = 1e5  # V/(count*s)


class Pid(NamedTuple):
    """Gains on the error in counts; one below zero would drive the carriage away."""

    kp: Annotated[
        float, Par("V/count", "proportional gain", "Section 4.3.1", lo=0.0, hi=STEEPEST)
    ] = 0.02
    ki: Annotated[
        float, Par("V/(count*s)", "integral gain", "Section 4.3.1", lo=0.0, hi=QUICKEST)
    ] = 0.007
    kd: Annotated[
        float, Par("V*s/count", "derivative gain", "Section 4.3.1", lo=0.0, hi=SHARPEST)
    ] = 0.0025


class PidMemory(NamedTuple):
    integral: Annotated[float, Meaning("integral effort", "V")]
    error: Annotated[float, Meaning("error of the last period", "count")]


@kernel
def start(error: Annotated[float, Meaning("taken as the last one", "count")]) -> PidMemory:
    """The memory before the first period (`error` in counts)."""
    return PidMemory(0.0, error)


@kernel
def step(
    p: Pid, s: PidMemory, error: float, dt: float
) -> tuple[
    Annotated[PidMemory, Meaning(name="memory")],
    Annotated[float, Meaning("effort", "V", name="effort")],
]:
    """One period of the PID (`error` in counts)."""
    integral = s.integral + p.ki * error * dt
    effort = p.kp * error + integral + p.kd * (error - s.error) / dt
    return PidMemory(integral, error), effort


LAWS = (Law("pid", Pid, start, step, compensated=False),)  # as the thesis runs it
