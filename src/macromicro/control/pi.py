"""P, PI and PI with back-calculated anti-windup for the micro-stage (Section 5.3)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.nominal import FULL_SCALE
from macromicro.schema.par import Par

HIGHEST = 1000.0  # V; beyond any converter: `ctrl_limit` is what counts
STEEPEST = 1e6  # V/m: the D/A's full scale of 5 V at 5 um, half of what counts as on target
QUICKEST = 1e9  # V/(m*s): one period of 1 ms adds as much as the steepest gain gives
SWIFTEST = 1000.0  # 1/s: the excess is gone in one period; from twice that the loop is unstable


def _kp(source: str) -> Par:
    return Par("V/m", "proportional gain", source, shown="V/mm", lo=0.0, hi=STEEPEST)


def _ki(source: str, most: float = QUICKEST) -> Par:
    return Par("V/(m*s)", "integral gain", source, shown="V/(mm*s)", lo=0.0, hi=most)


class Proportional(NamedTuple):
    """Section 5.3.1, Figures 5.19-5.20."""

    kp: Annotated[float, _kp("Section 5.3.1")] = 3e3
    ki: Annotated[float, _ki("Section 5.3.1", 0.0)] = 0.0
    kaw: Annotated[float, Par("1/s", "anti-windup gain", "Section 5.3.1", lo=0.0, hi=0.0)] = 0.0
    low: Annotated[float, Par("V", "lower limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = 0.0
    high: Annotated[float, Par("V", "upper limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = (
        FULL_SCALE
    )


class Pi(NamedTuple):
    """Section 5.3.1, Figures 5.22-5.23: winds up while the stage extends."""

    kp: Annotated[float, _kp("Section 5.3.1")] = 3e3
    ki: Annotated[float, _ki("Section 5.3.1")] = 2250.0
    kaw: Annotated[float, Par("1/s", "anti-windup gain", "Section 5.3.1", lo=0.0, hi=0.0)] = 0.0
    low: Annotated[float, Par("V", "lower limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = 0.0
    high: Annotated[float, Par("V", "upper limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = (
        FULL_SCALE
    )


class PiAntiWindup(NamedTuple):
    """Section 5.3.2, Figures 5.24-5.27: the integrator is held back by the saturation."""

    kp: Annotated[float, _kp("Section 5.3.2")] = 3e3
    ki: Annotated[float, _ki("Section 5.3.2")] = 3e4
    kaw: Annotated[float, Par("1/s", "anti-windup gain", "Section 5.3.2", lo=0.0, hi=SWIFTEST)] = (
        30.0
    )
    low: Annotated[float, Par("V", "lower limit", "Section 5.3.2", lo=0.0, hi=HIGHEST)] = 1.3
    high: Annotated[float, Par("V", "upper limit", "Section 5.3.2", lo=0.0, hi=HIGHEST)] = 1.9


@kernel
def step(
    p: PiAntiWindup, integral: float, error: Annotated[float, Meaning("error", "m")], dt: float
) -> tuple[
    Annotated[float, Meaning("new integral effort", "V", name="integral")],
    Annotated[float, Meaning("clamped", "V", name="effort")],
]:
    """One period of the PI with anti-windup (Figure 5.24): dI/dt = Ki e + Kaw (sat(u) - u)."""
    effort = p.kp * error + integral
    given = min(max(effort, p.low), p.high)
    # dI/dt = Ki e + Kaw (sat(u) - u)
    return integral + dt * (p.ki * error + p.kaw * (given - effort)), given
