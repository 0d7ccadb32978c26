"""P, PI and PI with back-calculated anti-windup for the micro-stage (Section 5.3)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.nominal import FULL_SCALE
from macromicro.schema.par import Par

HIGHEST = 1000.0  # V; beyond any converter: `ctrl_limit` is what counts
STEEPEST = 1000.0  # V/mm: the D/A's full scale of 5 V at 5 um, half of what counts as on target
QUICKEST = 1e6  # V/(mm*s): one period of 1 ms adds as much as the steepest gain gives
SWIFTEST = 1000.0  # 1/s: the excess is gone in one period; from twice that the loop is unstable


class Proportional(NamedTuple):
    """Section 5.3.1, Figures 5.19-5.20."""

    kp: Annotated[float, Par("V/mm", "proportional gain", "Section 5.3.1", lo=0.0, hi=STEEPEST)] = (
        3.0
    )
    ki: Annotated[float, Par("V/(mm*s)", "integral gain", "Section 5.3.1", lo=0.0, hi=0.0)] = 0.0
    kaw: Annotated[float, Par("1/s", "anti-windup gain", "Section 5.3.1", lo=0.0, hi=0.0)] = 0.0
    low: Annotated[float, Par("V", "lower limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = 0.0
    high: Annotated[float, Par("V", "upper limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = (
        FULL_SCALE
    )


class Pi(NamedTuple):
    """Section 5.3.1, Figures 5.22-5.23: winds up while the stage extends."""

    kp: Annotated[float, Par("V/mm", "proportional gain", "Section 5.3.1", lo=0.0, hi=STEEPEST)] = (
        3.0
    )
    ki: Annotated[float, Par("V/(mm*s)", "integral gain", "Section 5.3.1", lo=0.0, hi=QUICKEST)] = (
        2.25
    )
    kaw: Annotated[float, Par("1/s", "anti-windup gain", "Section 5.3.1", lo=0.0, hi=0.0)] = 0.0
    low: Annotated[float, Par("V", "lower limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = 0.0
    high: Annotated[float, Par("V", "upper limit", "Section 5.3.1", lo=0.0, hi=HIGHEST)] = (
        FULL_SCALE
    )


class PiAntiWindup(NamedTuple):
    """Section 5.3.2, Figures 5.24-5.27: the integrator is held back by the saturation."""

    kp: Annotated[float, Par("V/mm", "proportional gain", "Section 5.3.2", lo=0.0, hi=STEEPEST)] = (
        3.0
    )
    ki: Annotated[float, Par("V/(mm*s)", "integral gain", "Section 5.3.2", lo=0.0, hi=QUICKEST)] = (
        30.0
    )
    kaw: Annotated[float, Par("1/s", "anti-windup gain", "Section 5.3.2", lo=0.0, hi=SWIFTEST)] = (
        30.0
    )
    low: Annotated[float, Par("V", "lower limit", "Section 5.3.2", lo=0.0, hi=HIGHEST)] = 1.3
    high: Annotated[float, Par("V", "upper limit", "Section 5.3.2", lo=0.0, hi=HIGHEST)] = 1.9


@kernel
def step(p: PiAntiWindup, integral: float, error: float, dt: float) -> tuple[float, float]:
    """One period of the PI with anti-windup (Figure 5.24): dI/dt = Ki e + Kaw (sat(u) - u).

    Parameters
    ----------
    p : PiAntiWindup
        Gains and limits.
    integral : float
        Integral effort, V.
    error : float
        Error, mm.
    dt : float
        Control period, s.

    Returns
    -------
    integral : float
        New integral effort, V.
    effort : float
        Clamped, V.
    """
    effort = p.kp * error + integral
    given = min(max(effort, p.low), p.high)
    # dI/dt = Ki e + Kaw (sat(u) - u)
    return integral + dt * (p.ki * error + p.kaw * (given - effort)), given
