"""Benchmark PID (Section 4.3.1): no compensation of friction, no anti-windup."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.parameters import Par


class Pid(NamedTuple):
    """Gains on the error in counts."""

    kp: Annotated[float, Par("V/count", "proportional gain", "Section 4.3.1")] = 0.02
    ki: Annotated[float, Par("V/(count*s)", "integral gain", "Section 4.3.1")] = 0.007
    kd: Annotated[float, Par("V*s/count", "derivative gain", "Section 4.3.1")] = 0.0025


@kernel
def step(
    p: Pid, integral: float, error: float, error_before: float, dt: float
) -> tuple[float, float]:
    """New integral effort [V] and effort [V] from this and the last error [counts]."""
    integral = integral + p.ki * error * dt
    return integral, p.kp * error + integral + p.kd * (error - error_before) / dt
